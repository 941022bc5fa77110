//! Renders in parts on engines that their users have: a real Slurm cluster, GNU parallel. Where these are not installed
//! the tests say so and pass, unless `REQUIRE_CLUSTER` is set.

use assert_cmd::cargo::cargo_bin;
use gdpt::load::exr;
use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

const PARTS: u32 = 8;
const FLAGS: [&str; 4] = ["--size", "64x48", "--seed", "5"];

/// Whether all programs are there.
fn installed(programs: &[&str]) -> bool {
    let there = |name: &str| path().iter().any(|folder| folder.join(name).is_file());
    let missing: Vec<_> = programs.iter().filter(|name| !there(name)).collect();
    if missing.is_empty() {
        return true;
    }
    assert!(
        env::var_os("REQUIRE_CLUSTER").is_none(),
        "not installed: {missing:?}"
    );
    eprintln!("skipped: {missing:?} are not installed");
    false
}

/// The folders of programs, gdpt's first; daemons are not in everybody's.
fn path() -> Vec<PathBuf> {
    let gdpt = cargo_bin!("gdpt").parent().unwrap().to_path_buf();
    let mut folders = vec![gdpt];
    folders.extend(env::split_paths(&env::var_os("PATH").unwrap_or_default()));
    folders.extend(["/usr/sbin", "/sbin"].map(PathBuf::from));
    folders
}

fn command(program: impl Into<OsString>, folder: &Path) -> Command {
    let mut command = Command::new(program.into());
    command
        .current_dir(folder)
        .env("PATH", env::join_paths(path()).unwrap());
    command
}

fn here(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// The bits of all layers.
fn bits(path: &Path) -> Vec<(String, Vec<u32>)> {
    let file = exr::load(path).unwrap();
    let channels = file.channels.into_iter();
    let bits = |values: Vec<f32>| values.into_iter().map(f32::to_bits).collect();
    channels
        .map(|(name, values)| (name, bits(values)))
        .collect()
}

/// The picture of the same parts, rendered here one after another.
fn one_after_another(folder: &Path, spp: &str) -> PathBuf {
    let scene = here("scenes/glossy.obj");
    for number in 1..=PARTS {
        let mut render = command("gdpt", folder);
        render.arg("render").arg(&scene).args(FLAGS);
        render.args([
            "--quiet",
            "--spp",
            spp,
            "--part",
            &format!("{number}/{PARTS}"),
        ]);
        let name = format!("here-{number}.gdpt");
        assert!(render.args(["-o", &name]).status().unwrap().success());
    }
    let names = (1..=PARTS).map(|number| format!("here-{number}.gdpt"));
    let mut merge = command("gdpt", folder);
    merge.arg("merge").args(names);
    assert!(
        merge
            .args(["--quiet", "-o", "here.exr"])
            .status()
            .unwrap()
            .success()
    );
    folder.join("here.exr")
}

/// The output of a command of the cluster.
fn ask(folder: &Path, line: &str) -> String {
    let mut words = line.split(' ');
    let mut command = command(words.next().unwrap(), folder);
    command.env("SLURM_CONF", folder.join("slurm/slurm.conf"));
    let output = command.args(words).output().unwrap();
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Waits until `done`; panics with what the cluster has written when that takes too long.
fn wait(folder: &Path, what: &str, mut done: impl FnMut() -> bool) {
    let start = Instant::now();
    while !done() {
        if start.elapsed() > Duration::from_secs(240) {
            let log = |name: &str| fs::read_to_string(folder.join(name)).unwrap_or_default();
            let (queue, log) = (ask(folder, "squeue"), log("slurm/slurmctld.log"));
            panic!("{what} takes too long\n{queue}\n{log}");
        }
        sleep(Duration::from_millis(100));
    }
}

/// An array of parts, one of them killed and queued again, one node drained meanwhile, and the merge that waits for
/// all: the bits of the same parts rendered here.
#[test]
fn slurm() {
    if !installed(&["munged", "slurmctld", "slurmd", "sbatch"]) {
        return;
    }
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    // Long enough that parts are running when one is killed.
    let spp = "3200";

    // The cluster lives as long as somebody waits for its input.
    let mut cluster = command(here("tests/cluster/slurm"), folder)
        .arg(folder.join("slurm"))
        .arg("cat")
        .stdin(Stdio::piped())
        .spawn()
        .unwrap();
    wait(folder, "the start", || {
        ask(folder, "sinfo --noheader --format=%D --states=idle").trim() == "4"
    });

    let mut submit = command(here("scenes/cluster/slurm.sh"), folder);
    submit.env("SLURM_CONF", folder.join("slurm/slurm.conf"));
    submit
        .arg(here("scenes/glossy.obj"))
        .arg("out.exr")
        .arg(PARTS.to_string());
    submit.args(FLAGS).args(["--spp", spp, "--every", "0.2s"]);
    assert!(submit.status().unwrap().success());

    // The third part is killed once it has kept something, and queued again. No new parts go to a node. The last part
    // is told to end, and queues itself.
    let running = |part: &str| {
        let jobs = ask(folder, "squeue --noheader --states=R --format=%A,%F_%K");
        let lines = jobs.lines().filter_map(|line| line.split_once(','));
        let mut of_part = lines.filter(|(_, name)| name.ends_with(&format!("_{part}")));
        of_part
            .next()
            .map(|(job, name)| (job.to_owned(), name.to_owned()))
    };
    let third = folder.join("out.parts/part-00003.gdpt");
    wait(folder, "the third part", || third.exists());
    let (job, _) = running("3").expect("the third part is running");
    ask(folder, &format!("scontrol requeue {job}"));
    ask(
        folder,
        "scontrol update nodename=n4 state=drain reason=test",
    );
    let last = folder.join("out.parts/part-00008.gdpt");
    wait(folder, "the last part", || last.exists());
    let (_, name) = running("8").expect("the last part is running");
    ask(folder, &format!("scancel --signal=TERM --batch {name}"));

    let merged = folder.join("out.exr");
    wait(folder, "the render", || {
        merged.exists() && ask(folder, "squeue --noheader").trim().is_empty()
    });
    for part in 1..=PARTS {
        let log = fs::read_to_string(folder.join(format!("out.parts/{part}.log"))).unwrap();
        assert_eq!(
            log.contains("going on from"),
            [3, 8].contains(&part),
            "{part}: {log}"
        );
    }
    drop(cluster.stdin.take());
    assert!(cluster.wait().unwrap().success());
    assert!(bits(&merged) == bits(&one_after_another(folder, spp)));
}

/// The same by GNU parallel, on this machine.
#[test]
fn parallel() {
    if !installed(&["parallel"]) {
        return;
    }
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let run = || {
        let mut run = command(here("scenes/cluster/parallel.sh"), folder);
        run.arg(":")
            .arg(here("scenes/glossy.obj"))
            .arg("out.exr")
            .arg(PARTS.to_string());
        run.args(FLAGS).args(["--spp", "64"]);
        assert!(run.stdout(Stdio::null()).status().unwrap().success());
    };
    run();
    let once = bits(&folder.join("out.exr"));
    assert!(once == bits(&one_after_another(folder, "64")));
    // Only what is missing is rendered again.
    let part = |number: u32| folder.join(format!("out.parts/part-{number}.gdpt"));
    let kept = fs::read(part(1)).unwrap();
    fs::remove_file(part(2)).unwrap();
    run();
    assert!(fs::read(part(1)).unwrap() == kept);
    assert!(bits(&folder.join("out.exr")) == once);
}
