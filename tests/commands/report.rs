//! `gdpt chart` from the shell, and its report in a browser.

use assert_cmd::cargo::cargo_bin;
use gdpt::chart::Row;
use headless_chrome::protocol::cdp::Page::CaptureScreenshotFormatOption::Png;
use headless_chrome::{Browser, LaunchOptions, Tab};
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};
use std::time::Duration;

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

/// A number that a script gives.
fn number(tab: &Tab, script: &str) -> f64 {
    let value = tab.evaluate(script, false).unwrap().value;
    value.and_then(|v| v.as_f64()).unwrap_or(f64::NAN)
}

#[test]
fn the_report_works_in_a_browser() {
    let options = LaunchOptions::default_builder()
        .sandbox(false) // Chromium has none for root
        .window_size(Some((1200, 2400)))
        .idle_browser_timeout(Duration::from_secs(60))
        .build();
    let browser = match options
        .map_err(|e| e.to_string())
        .and_then(|o| Browser::new(o).map_err(|e| e.to_string()))
    {
        Ok(browser) => browser,
        Err(e) if std::env::var_os("REQUIRE_CHROMIUM").is_none() => {
            eprintln!("skipped: no Chromium that starts ({e})");
            return;
        }
        Err(e) => panic!("Chromium is required and does not start: {e}"),
    };
    let folder = tempfile::tempdir().unwrap();
    assert!(chart(folder.path()).success());
    let page = folder.path().join("report.html");

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

    let tab = browser.new_tab().unwrap();
    tab.navigate_to(&format!("file://{}", page.display()))
        .unwrap();
    let viewer = tab.wait_for_element(".viewer[data-ready]").unwrap();
    let stage = viewer.find_element(".stage").unwrap();
    let before = stage.capture_screenshot(Png).unwrap();
    let at = |tab: &Tab| {
        number(
            tab,
            "parseFloat(document.querySelector('.divider').style.left) /
             document.querySelector('.stage').clientWidth",
        )
    };
    assert!((at(&tab) - 0.5).abs() < 0.01, "{}", at(&tab));

    // A click on the slider moves the divider, and shows more of the right picture.
    let slider = viewer.find_element(".slider").unwrap();
    let place = slider.get_box_model().unwrap().content_viewport();
    tab.click_point(headless_chrome::browser::tab::point::Point {
        x: place.x + 0.2 * place.width,
        y: place.y + 0.5 * place.height,
    })
    .unwrap();
    assert!((at(&tab) - 0.2).abs() < 0.05, "{}", at(&tab));
    let value = number(&tab, "Number(document.querySelector('.slider').value)");
    assert!((value - 20.0).abs() < 5.0, "{value}");
    let after = stage.capture_screenshot(Png).unwrap();
    assert_ne!(before, after);

    // Zooming makes the picture larger, another choice shows another picture.
    let width = "document.querySelector('.over').getBoundingClientRect().width";
    let small = number(&tab, width);
    viewer
        .find_element("[data-zoom=in]")
        .unwrap()
        .click()
        .unwrap();
    assert!((number(&tab, width) / small - 2.0).abs() < 0.01);
    let source = |tab: &Tab| {
        let script = "document.querySelector('.over').src";
        tab.evaluate(script, false)
            .unwrap()
            .value
            .unwrap()
            .to_string()
    };
    let picture = source(&tab);
    tab.evaluate(
        "const kind = document.querySelector('.kind'); kind.value = 'error';
         kind.dispatchEvent(new Event('change'))",
        false,
    )
    .unwrap();
    assert_ne!(picture, source(&tab));
    assert_eq!(
        number(
            &tab,
            "document.querySelectorAll('.viewer[data-ready]').length"
        ),
        2.0
    );
}
