use std::str::FromStr;

use serde::Serialize;
use serde_json::Value;

use crate::exit::Exit;
use crate::failure::Failure;

/// A condition under which the program ends with exit code 4, such as `rmse>0.3`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Gate {
    name: String,
    above: bool,
    limit: f64,
}

impl FromStr for Gate {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("expected NAME>NUMBER or NAME<NUMBER, found `{text}`");
        let at = text.find(['<', '>']).ok_or_else(wrong)?;
        let (name, limit) = (text[..at].trim(), text[at + 1..].trim().parse::<f64>().map_err(|_| wrong())?);
        if name.is_empty() || limit.is_nan() {
            return Err(wrong());
        }
        Ok(Self { name: name.to_owned(), above: text[at..].starts_with('>'), limit })
    }
}

/// Fails where one of the conditions holds for the numbers of `report`, which are named as in its JSON.
pub(crate) fn check(gates: &[Gate], report: &impl Serialize) -> Result<(), Failure> {
    if gates.is_empty() {
        return Ok(());
    }
    let document = serde_json::to_value(report).unwrap_or_default();
    for gate in gates {
        let Some(value) = gate.find(&document) else {
            let message = format!("there is no number `{}` in these results", gate.name);
            return Err(Failure::new(Exit::Usage, "gate.name", message)
                .help("the names are those that --json prints, joined by dots"));
        };
        if (gate.above && value > gate.limit) || (!gate.above && value < gate.limit) {
            let sign = if gate.above { '>' } else { '<' };
            let message = format!("{} is {value:.6}: the gate `{}{sign}{}` fails", gate.name, gate.name, gate.limit);
            return Err(Failure::new(Exit::Gate, "gate.failed", message));
        }
    }
    Ok(())
}

impl Gate {
    /// The number that the gate names; the seven figures of the absolute error need no path.
    fn find(&self, document: &Value) -> Option<f64> {
        let path = format!("/{}", self.name.replace('.', "/"));
        let short = format!("/ate/translation_m/{}", self.name);
        document.pointer(&path).or_else(|| document.pointer(&short)).and_then(Value::as_f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gates_are_read_and_checked() {
        let document = serde_json::json!({ "ate": { "translation_m": { "rmse": 0.5 } }, "map": { "free_iou": 0.9 } });
        let check = |gate: &str| check(&[gate.parse().unwrap()], &document).map_err(|failure| failure.exit);
        assert_eq!(check("rmse>0.3"), Err(Exit::Gate));
        assert_eq!(check("rmse > 0.6"), Ok(()));
        assert_eq!(check("map.free_iou<0.95"), Err(Exit::Gate));
        assert_eq!(check("rsme>0.3"), Err(Exit::Usage));
        assert!("rmse=0.3".parse::<Gate>().is_err());
        assert!("rmse>x".parse::<Gate>().is_err());
    }
}
