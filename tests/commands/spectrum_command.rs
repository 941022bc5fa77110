//! `gdpt spectrum` from the shell.

use assert_cmd::Command;
use std::path::Path;

fn run(folder: &Path, arguments: &[&str]) -> (bool, String, String) {
    let mut command = Command::cargo_bin("gdpt").unwrap();
    command
        .arg("spectrum")
        .args(arguments)
        .arg("-o")
        .arg(folder);
    let output = command.output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (
        output.status.success(),
        text(output.stdout),
        text(output.stderr),
    )
}

#[test]
fn a_scene_has_a_table_and_figures() {
    let folder = tempfile::tempdir().unwrap();
    let flags = [
        "scenes/cornell.obj",
        "--size",
        "32x24",
        "--renders",
        "12",
        "--spp",
        "2",
    ];
    let (done, text, error) = run(folder.path(), &flags);
    assert!(done, "{error}");
    for word in ["best alpha", "by octave", "correlation", "noisiest 1 %"] {
        assert!(text.contains(word), "{text}");
    }
    for file in [
        "spectrum.svg",
        "spectrum.png",
        "alpha.svg",
        "alpha.png",
        "primal-variance.png",
        "gradient-variance.png",
    ] {
        assert!(
            folder.path().join(format!("cornell-{file}")).exists(),
            "{file}"
        );
    }
    let mut csv = csv::Reader::from_path(folder.path().join("cornell-spectrum.csv")).unwrap();
    let head = csv.headers().unwrap().clone();
    let rows: Vec<Vec<f64>> = csv
        .records()
        .map(|r| r.unwrap().iter().map(|v| v.parse().unwrap()).collect())
        .collect();
    assert!(rows.len() > 10);
    let column = |name: &str| head.iter().position(|h| h == name).unwrap();
    let coefficients: f64 = rows.iter().map(|r| r[column("coefficients")]).sum();
    assert_eq!(coefficients, 32.0 * 24.0 - 1.0);
    // α = 0.2, which is asked for by default, is better than the primal at the highest frequency.
    let last = &rows[rows.len() - 1];
    assert!(last[column("alpha_0.2")] < 0.5 * last[column("primal")]);
}

#[test]
fn the_experiment_in_one_dimension_tells_how_exact_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let (done, text, error) = run(folder.path(), &["--one-dimensional"]);
    assert!(done, "{error}");
    assert_eq!(text.lines().count(), 2);
    for name in ["independent", "shared"] {
        assert!(
            folder
                .path()
                .join(format!("one-dimension-{name}.svg"))
                .exists()
        );
    }
}

#[test]
fn what_cannot_be_measured_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    for (flags, says) in [
        (
            &["scenes/cornell.obj", "--renders", "1"][..],
            "--renders must be at least 2",
        ),
        (
            &["scenes/cornell.obj", "--size", "1x9"],
            "at least 2x2 pixels",
        ),
        (&["absent.obj"], "absent.obj"),
    ] {
        let (done, _, error) = run(folder.path(), flags);
        assert!(!done && error.contains(says), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    let (done, ..) = run(folder.path(), &["scenes/cornell.obj", "--alphas", "0"]);
    assert!(!done);
}
