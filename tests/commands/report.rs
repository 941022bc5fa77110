//! `gdpt chart` from the shell, and its report in a browser.

use assert_cmd::cargo::cargo_bin;
use gdpt::chart::Row;
use serde_json::Value;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};

/// A small chart of two scenes, or what is missing of it.
fn chart(folder: &Path) -> ExitStatus {
    let arguments = [
        "chart",
        "scenes/corner.obj",
        "scenes/mirrors.obj",
        "--size",
        "48x32",
        "--time",
        "0.3s",
        "--seeds",
        "2",
        "--quiet",
        "-o",
    ];
    let mut command = Command::new(cargo_bin!("gdpt"));
    command.args(arguments).arg(folder);
    command.status().unwrap()
}

fn rows(folder: &Path) -> Vec<Row> {
    let mut csv = csv::Reader::from_path(folder.join("chart.csv")).unwrap();
    csv.deserialize().map(Result::unwrap).collect()
}

#[test]
fn a_chart_is_complete_and_goes_on_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    assert!(chart(folder).success());

    // All rows.
    let first = rows(folder);
    for scene in ["corner", "mirrors"] {
        for method in ["pt", "l2", "l1", "weighted"] {
            for seed in 0..2 {
                let run = first
                    .iter()
                    .filter(|r| r.scene == scene && r.method == method && r.seed == seed);
                let run: Vec<&Row> = run.collect();
                assert!(run.len() > 3, "{scene} {method} {seed}: {}", run.len());
                assert!(run.windows(2).all(|w| w[0].samples <= w[1].samples));
                assert_eq!(run.iter().filter(|r| r.last).count(), 1);
                let (few, many) = (run[0], run[run.len() - 1]);
                assert!(
                    many.rel_mse < few.rel_mse,
                    "{scene} {method}: {few:?} {many:?}"
                );
            }
        }
        for file in ["seconds.svg", "seconds.png", "samples.svg", "samples.png"] {
            assert!(folder.join(format!("{scene}-{file}")).exists());
        }
    }

    // Nothing is rendered again: the seconds are the same.
    assert!(chart(folder).success());
    assert_eq!(rows(folder), first);

    // One run lost and one damaged: these alone are rendered again.
    let kept = |what: &str| -> PathBuf {
        let files = fs::read_dir(folder.join("cache")).unwrap();
        let mut paths = files.map(|f| f.unwrap().path());
        let starts = |p: &PathBuf| p.file_name().unwrap().to_str().unwrap().starts_with(what);
        paths
            .find(|p| starts(p) && p.extension() == Some(OsStr::new("json")))
            .unwrap()
    };
    fs::remove_file(kept("corner-pt-embree-1")).unwrap();
    fs::write(kept("mirrors-gpt-embree-0"), "[{").unwrap();
    assert!(chart(folder).success());
    let again = rows(folder);
    let changed = |row: &Row| {
        row.scene == "corner" && row.method == "pt" && row.seed == 1
            || row.scene == "mirrors" && row.method != "pt" && row.seed == 0
    };
    let unchanged = |rows: &[Row]| -> Vec<Row> {
        let rows = rows.iter().filter(|r| !changed(r));
        rows.cloned().collect()
    };
    assert_eq!(unchanged(&again), unchanged(&first));
    assert_ne!(again, first);
    // Errors are a function of scene, settings, seed and samples, whatever the time.
    for row in again.iter().filter(|r| !r.last) {
        let same = |r: &&Row| {
            (&r.scene, &r.method, r.seed, r.samples)
                == (&row.scene, &row.method, row.seed, row.samples)
        };
        if let Some(before) = first.iter().find(same) {
            assert_eq!(row.rel_mse, before.rel_mse, "{row:?}");
        }
    }
}

/// What the page's script does when the divider is moved, when it is enlarged, and when another picture is chosen; told
/// in an element of the page.
const CLICKS: &str = r#"<pre id="told"></pre><script>
"use strict";
const told = {};
const get = (selector) => document.querySelector(selector);
const divider = () => parseFloat(get(".divider").style.left) / get(".stage").clientWidth;
const width = () => get(".over").getBoundingClientRect().width;
function clicks() {
  told.viewers = document.querySelectorAll(".viewer[data-ready]").length;
  if (told.viewers < document.querySelectorAll(".viewer").length) return setTimeout(clicks, 10);
  told.before = divider();
  get(".slider").value = 20;
  get(".slider").dispatchEvent(new Event("input"));
  told.after = divider();
  told.cut = get(".over").style.clipPath;
  told.small = width();
  get("[data-zoom=in]").click();
  told.large = width();
  told.picture = get(".over").src;
  get(".kind").value = "error";
  get(".kind").dispatchEvent(new Event("change"));
  told.error = get(".over").src;
  document.getElementById("told").textContent = JSON.stringify(told);
}
clicks();
</script>"#;

/// The program of the browser, if there is one.
fn chromium() -> Option<&'static str> {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    names.into_iter().find(|name| {
        let version = Command::new(name).arg("--version").output();
        version.is_ok_and(|output| output.status.success())
    })
}

/// What the browser prints of a page.
fn browse(chromium: &str, page: &Path, flags: &[String]) -> String {
    let home = tempfile::tempdir().unwrap();
    let output = Command::new(chromium)
        // It has no sandbox for root.
        .args(["--headless", "--no-sandbox", "--disable-gpu"])
        .args(["--window-size=1200,2400", "--virtual-time-budget=60000"])
        .arg(format!("--user-data-dir={}", home.path().display()))
        .args(flags)
        .arg(format!("file://{}", page.display()))
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_report_works_in_a_browser() {
    let Some(chromium) = chromium() else {
        assert!(
            std::env::var_os("REQUIRE_CHROMIUM").is_none(),
            "no Chromium"
        );
        eprintln!("skipped: no Chromium");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    assert!(chart(folder).success());
    let page = folder.join("report.html");

    // Everything is in the page.
    let text = fs::read_to_string(&page).unwrap();
    let addresses = text.match_indices("http").map(|(i, _)| &text[i..]);
    for address in addresses {
        assert!(
            address.starts_with("http://www.w3.org/2000/svg"),
            "{}",
            &address[..60]
        );
    }

    let clicked = folder.join("clicked.html");
    fs::write(&clicked, text + CLICKS).unwrap();
    let dom = browse(chromium, &clicked, &["--dump-dom".to_owned()]);
    let told = dom.split("<pre id=\"told\">").nth(1).unwrap();
    let told = told.split("</pre>").next().unwrap().replace("&amp;", "&");
    let told: Value = serde_json::from_str(&told).unwrap_or_else(|e| panic!("{e}: {told}"));
    let number = |name: &str| told[name].as_f64().unwrap_or(f64::NAN);
    assert_eq!(number("viewers"), 2.0);
    // The divider is in the middle, and where it is moved to, and there the right picture begins.
    assert!((number("before") - 0.5).abs() < 0.01, "{told}");
    assert!((number("after") - 0.2).abs() < 0.01, "{told}");
    assert!(told["cut"].as_str().unwrap().starts_with("inset"), "{told}");
    // Larger, and another picture.
    let larger = number("large") / number("small");
    assert!((larger - 2.0).abs() < 0.01, "{told}");
    assert_ne!(told["picture"], told["error"]);

    // All that is seen.
    let seen = [&page, &clicked].map(|page| {
        let picture = page.with_extension("png");
        browse(
            chromium,
            page,
            &[format!("--screenshot={}", picture.display())],
        );
        image::open(picture).unwrap().into_rgb8()
    });
    assert_ne!(seen[0], seen[1]);
}
