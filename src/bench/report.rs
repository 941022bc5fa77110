//! The measurements as a table for people, and as JSON and CSV for machines.

use super::measure::Row;
use crate::error::Result;
use crate::output::{write_json, write_whole};
use std::path::Path;

/// The table. A star marks the way that the renderer goes.
pub fn table(rows: &[Row]) -> String {
    let mut text = String::new();
    let mut backend = "";
    for row in rows {
        if row.backend != backend {
            backend = row.backend;
            text += &format!(
                "\n{backend}: built in {:.2} s, {:.1} MB, {} threads\n{:<14}{:<22}{:>9}{:>18}{:>9}{:>9}\n",
                row.build_seconds,
                row.tree_bytes as f64 / 1e6,
                row.threads,
                "rays",
                "way",
                "Mray/s",
                "slowest-fastest",
                "rays",
                "hits",
            );
        }
        text += &format!(
            "{:<14}{:<22}{:>9.2}{:>18}{:>9}{:>9}\n",
            row.kind,
            format!("{}{}", row.way, if row.chosen { " *" } else { "" }),
            row.mrays_per_second,
            format!("{:.2}-{:.2}", row.slowest, row.fastest),
            row.rays,
            row.hits,
        );
    }
    text += "\n* the way that gdpt render goes\n";
    text
}

/// Writes the rows as a JSON array.
pub fn json(path: &Path, rows: &[Row]) -> Result<()> {
    write_json(path, rows)
}

/// Writes the rows as CSV with a header.
pub fn csv(path: &Path, rows: &[Row]) -> Result<()> {
    write_whole(path, |file| {
        writeln!(
            file,
            "backend,kind,way,chosen,rays,hits,mrays_per_second,slowest,fastest,build_seconds,tree_bytes,threads"
        )?;
        for r in rows {
            writeln!(
                file,
                "{},{},{},{},{},{},{},{},{},{},{},{}",
                r.backend,
                r.kind,
                r.way,
                r.chosen,
                r.rays,
                r.hits,
                r.mrays_per_second,
                r.slowest,
                r.fastest,
                r.build_seconds,
                r.tree_bytes,
                r.threads
            )?;
        }
        Ok(())
    })
}
