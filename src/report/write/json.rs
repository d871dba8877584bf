//! metrics.json: a report without its pictures.

use crate::report::scaffold_report::ScaffoldReport;

/// Returns the object, with line breaks. Non-finite numbers are null.
pub fn json(report: &ScaffoldReport) -> String {
    let text =
        serde_json::to_string_pretty(report).expect("a report has no keys but texts and no serialiser that fails");
    text + "\n"
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::report::fixture;

    #[test]
    fn a_report_is_an_object_with_nulls_for_what_is_not_there() {
        let rich: Value = serde_json::from_str(&json(&fixture::rich())).unwrap();
        assert_eq!((&rich["schema"], &rich["unit"]), (&"ldi-ops-report/1".into(), &"mm".into()));
        let porosity = &rich["metrics"][2];
        assert_eq!((&porosity["id"], &porosity["unit"]), (&"porosity".into(), &"1".into()));
        assert_eq!(porosity["parameters"]["pitch"], "0.039 mm");
        assert_eq!(rich["metrics"][5]["unit"], "mm^2");
        assert_eq!(rich["verdict"]["limits"][1]["outcome"], "kept-within-bounds");
        assert_eq!(rich["profiles"][0]["porosity"][40], Value::Null);
        assert_eq!(rich["provenance"]["seconds"]["read"], 0.31);
        assert!(rich.get("pictures").is_none());

        let poor: Value = serde_json::from_str(&json(&fixture::poor())).unwrap();
        assert_eq!(
            (&poor["unit"], &poor["verdict"], &poor["title"]),
            (&Value::Null, &Value::Null, &fixture::AWKWARD.into())
        );
        assert_eq!((&poor["metrics"][0]["value"], &poor["metrics"][1]["lower"]), (&Value::Null, &Value::Null));
    }
}
