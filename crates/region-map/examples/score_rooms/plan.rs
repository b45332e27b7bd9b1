//! Floor plans with hand-cut rooms.

use std::{collections::VecDeque, fs::File, io::BufReader, path::Path};

/// A grey picture.
#[derive(Debug, Clone)]
pub(crate) struct Picture {
    pub(crate) rows: usize,
    pub(crate) columns: usize,
    pub(crate) grey: Vec<u8>,
}

/// Reads a PNG as grey, alpha dropped.
pub(crate) fn read_grey(path: &Path) -> Result<Picture, String> {
    let say = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
    let file = File::open(path).map_err(|e| say(&e))?;
    let mut decoder = png::Decoder::new(BufReader::new(file));
    decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::STRIP_16);
    let mut reader = decoder.read_info().map_err(|e| say(&e))?;
    let mut bytes = vec![0; reader.output_buffer_size().ok_or_else(|| say(&"too large"))?];
    let info = reader.next_frame(&mut bytes).map_err(|e| say(&e))?;
    let samples = info.color_type.samples();
    let grey = bytes[..info.buffer_size()]
        .chunks_exact(samples)
        .map(|p| match samples {
            1 | 2 => p[0],
            _ => luma([p[0], p[1], p[2]]),
        })
        .collect();
    Ok(Picture { rows: info.height as usize, columns: info.width as usize, grey })
}

/// Brightness of a colour (ITU-R BT.601).
fn luma([red, green, blue]: [u8; 3]) -> u8 {
    let sum = u32::from(red) * 299 + u32::from(green) * 587 + u32::from(blue) * 114;
    u8::try_from(sum / 1000).unwrap_or(u8::MAX)
}

impl Picture {
    /// 4-connected regions of white (≥ 250), labelled from 1.
    pub(crate) fn white_regions(&self) -> Vec<u32> {
        let mut labels = vec![0; self.grey.len()];
        let mut next = 0;
        let mut queue = VecDeque::new();
        for start in 0..labels.len() {
            if labels[start] != 0 || self.grey[start] < 250 {
                continue;
            }
            next += 1;
            labels[start] = next;
            queue.push_back(start);
            while let Some(at) = queue.pop_front() {
                let column = at % self.columns;
                let around = [
                    (column > 0).then(|| at - 1),
                    (column + 1 < self.columns).then(|| at + 1),
                    (at >= self.columns).then(|| at - self.columns),
                    (at + self.columns < labels.len()).then(|| at + self.columns),
                ];
                for to in around.into_iter().flatten() {
                    if labels[to] == 0 && self.grey[to] >= 250 {
                        labels[to] = next;
                        queue.push_back(to);
                    }
                }
            }
        }
        labels
    }
}

/// The plans of a folder: every `NAME_gt.png` names one.
pub(crate) fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .map(|entries| {
            entries
                .filter_map(|e| Some(e.ok()?.file_name().to_string_lossy().strip_suffix("_gt.png")?.to_owned()))
                .collect()
        })
        .unwrap_or_default();
    names.sort();
    names
}
