//! The screened Poisson equation with constant weights, solved exactly in the cosine basis.

use rayon::prelude::*;
use rustdct::{DctPlanner, TransformType2And3};
use std::sync::Arc;

/// Solves (screen + smooth·L) x = b, where L is the Laplacian DᵀD of a grid with reflecting borders.
/// It is diagonal in the basis of the DCT-II, with eigenvalues 4 − 2cos(πk/W) − 2cos(πl/H).
pub(super) struct ScreenedPoisson {
    width: usize,
    height: usize,
    along_rows: Arc<dyn TransformType2And3<f32>>,
    along_columns: Arc<dyn TransformType2And3<f32>>,
    /// The parts 2 − 2cos(πk/W) and 2 − 2cos(πl/H) of the eigenvalues.
    eigenvalues: (Vec<f32>, Vec<f32>),
}

impl ScreenedPoisson {
    pub(super) fn new(width: usize, height: usize) -> Self {
        let mut planner = DctPlanner::new();
        let eigenvalues = |n: usize| {
            let angle = |k: usize| std::f64::consts::PI * k as f64 / n as f64;
            (0..n)
                .map(|k| (2.0 - 2.0 * angle(k).cos()) as f32)
                .collect()
        };
        Self {
            width,
            height,
            along_rows: planner.plan_dct2(width),
            along_columns: planner.plan_dct2(height),
            eigenvalues: (eigenvalues(width), eigenvalues(height)),
        }
    }

    /// Columns and rows of the grid.
    pub(super) fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Solves in place. Where the operator is 0 (the mean, without a screen) the result is 0.
    pub(super) fn solve(&self, data: &mut Vec<f32>, screen: f32, smooth: f32) {
        let (w, h) = (self.width, self.height);
        // DCT-II along rows, then, transposed, along columns.
        data.par_chunks_mut(w).for_each_init(
            || vec![0.0; self.along_rows.get_scratch_len()],
            |scratch, row| self.along_rows.process_dct2_with_scratch(row, scratch),
        );
        let mut columns = transpose(data, w, h);
        columns.par_chunks_mut(h).enumerate().for_each_init(
            || vec![0.0; self.along_columns.get_scratch_len()],
            |scratch, (k, column)| {
                self.along_columns
                    .process_dct2_with_scratch(column, scratch);
                // Divide by the eigenvalue. DCT-III undoes DCT-II up to the factor n/2.
                let scale = 4.0 / (w as f32 * h as f32);
                for (l, value) in column.iter_mut().enumerate() {
                    let operator =
                        screen + smooth * (self.eigenvalues.0[k] + self.eigenvalues.1[l]);
                    *value = if operator > 0.0 {
                        *value * scale / operator
                    } else {
                        0.0
                    };
                }
                self.along_columns
                    .process_dct3_with_scratch(column, scratch);
            },
        );
        *data = transpose(&columns, h, w);
        data.par_chunks_mut(w).for_each_init(
            || vec![0.0; self.along_rows.get_scratch_len()],
            |scratch, row| self.along_rows.process_dct3_with_scratch(row, scratch),
        );
    }
}

/// The transpose of `height` rows of `width` values, in blocks that stay in the cache.
pub(super) fn transpose(data: &[f32], width: usize, height: usize) -> Vec<f32> {
    const BLOCK: usize = 32;
    let mut out = vec![0.0; data.len()];
    out.par_chunks_mut(BLOCK * height)
        .enumerate()
        .for_each(|(block, out)| {
            let first = block * BLOCK;
            for y0 in (0..height).step_by(BLOCK) {
                for (column, out) in out.chunks_mut(height).enumerate() {
                    for y in y0..(y0 + BLOCK).min(height) {
                        out[y] = data[y * width + first + column];
                    }
                }
            }
        });
    out
}
