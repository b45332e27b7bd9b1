use serde::Serialize;

use crate::exit::Exit;
use crate::failure::Failure;

/// The page with its style and its script; words in double braces are filled in.
pub(super) const REPORT: &str = include_str!("template/report.html");
const STYLE: &str = include_str!("template/style.css");
/// The script in the order in which its parts need each other.
const SCRIPT: [&str; 7] = [
    include_str!("template/data.js"),
    include_str!("template/images.js"),
    include_str!("template/view.js"),
    include_str!("template/layers.js"),
    include_str!("template/replay.js"),
    include_str!("template/inspector.js"),
    include_str!("template/page.js"),
];

/// The page with everything filled in; each part once, so that what is filled in is never searched for braces.
pub(super) fn fill(template: &str, parts: &[(&str, String)]) -> String {
    let script = format!("(() => {{\n\"use strict\";\n{}}})();", SCRIPT.concat());
    let mut page = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        let Some((name, after)) = after.split_once("}}") else { break };
        page.push_str(before);
        match name {
            "style" => page.push_str(STYLE),
            "script" => page.push_str(&script),
            _ => page.push_str(parts.iter().find(|(part, _)| *part == name).map_or("", |(_, text)| text)),
        }
        rest = after;
    }
    page + rest
}

/// JSON that may stand in a page: nothing in it ends the element that holds it.
pub(super) fn json(document: &impl Serialize) -> Result<String, Failure> {
    let text = serde_json::to_string(document)
        .map_err(|error| Failure::new(Exit::Failed, "internal.json", format!("could not write JSON: {error}")))?;
    Ok(text.replace('<', "\\u003c"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_filled_in_is_not_filled_again() {
        let page = fill(REPORT, &[("name", "{{about}}".into()), ("about", "said once".into())]);
        assert_eq!(page.matches("said once").count(), REPORT.matches("{{about}}").count());
        assert!(page.contains("{{about}}"));
    }

    #[test]
    fn data_cannot_end_its_element() {
        assert_eq!(json(&"</script>").unwrap(), "\"\\u003c/script>\"");
    }
}
