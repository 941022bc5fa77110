//! A multigrid cycle for the screened Poisson equation with a weight for every difference and every
//! pixel: the preconditioner of the conjugate gradients.
//!
//! Each level has cells of twice the side. A coarse cell's pixel weight is the sum of its cells', a coarse
//! difference's weight a share of the sum of those that it crosses. Values go up and down bilinearly, with
//! one weighted Jacobi step before and one after on the way.
//!
//! Why not the cosine transform as the preconditioner: the weights span many orders of magnitude, which
//! one frequency response cannot follow. At 64 samples and 256x256, 60 steps with it left a squared error
//! of 0.002 (cornell), 0.02 (glossy) and 0.7 (ajar) of the picture's own noise; multigrid was there after
//! 10, 3 and 1 (a prototype's figures, one channel). A step of either costs about the same.

use rayon::prelude::*;

/// Rows handled by one task; fixed, so that results do not depend on the number of threads.
pub(super) const ROWS: usize = 16;
/// Step of the Jacobi method. Below 1, so that a cycle is positive definite, as conjugate gradients need.
const DAMPING: f32 = 0.8;
/// A coarse difference spans twice the distance, so half the sum of the weights is right where they are
/// all the same. With somewhat more the tolerance is met sooner: at 1920x1080 (cornell, 8 samples) after
/// 55 instead of 166 steps, the error left being 0.033 instead of 0.010 of the primal's.
const CROSSING_SHARE: f32 = 0.6;

/// The operator v + Dᵀ w D on one grid.
pub(super) struct Operator {
    width: usize,
    height: usize,
    /// Weights of the pixels, ≥ 0.
    v: Vec<f32>,
    /// Weights of the differences to the right and downwards, ≥ 0; 0 where there is none.
    wx: Vec<f32>,
    wy: Vec<f32>,
    /// One over the diagonal.
    inverse: Vec<f32>,
}

/// The operators of all levels, the finest first, with room for the values in between.
pub(super) struct Multigrid {
    levels: Vec<Level>,
}

struct Level {
    operator: Operator,
    /// The right side, its approximate solution, and the residual.
    b: Vec<f32>,
    x: Vec<f32>,
    r: Vec<f32>,
}

impl Operator {
    /// Takes weights for `width` columns; those of differences across the border are set to 0.
    pub(super) fn new(width: usize, v: Vec<f32>, mut wx: Vec<f32>, mut wy: Vec<f32>) -> Self {
        let height = v.len() / width;
        wx.chunks_mut(width).for_each(|row| row[width - 1] = 0.0);
        wy[(height - 1) * width..].fill(0.0);
        let mut operator = Self {
            width,
            height,
            v,
            wx,
            wy,
            inverse: Vec::new(),
        };
        let mut inverse = vec![0.0; width * height];
        operator.by_rows(&mut inverse, |y, out| {
            let row = y * width..(y + 1) * width;
            out.copy_from_slice(&operator.v[row.clone()]);
            let mut add = |weights: &[f32]| out.iter_mut().zip(weights).for_each(|(o, w)| *o += w);
            add(&operator.wy[row.clone()]);
            add(&operator.wx[row.clone()]);
            if y > 0 {
                add(&operator.wy[row.start - width..row.end - width]);
            }
            let wx = &operator.wx[row];
            out[1..].iter_mut().zip(wx).for_each(|(o, w)| *o += w);
            out.iter_mut()
                .for_each(|d| *d = if *d > 0.0 { 1.0 / *d } else { 0.0 });
        });
        operator.inverse = inverse;
        operator
    }

    /// Fills `out` row by row, in parallel.
    fn by_rows(&self, out: &mut [f32], fill: impl Fn(usize, &mut [f32]) + Sync) {
        out.par_chunks_mut(self.width * ROWS)
            .enumerate()
            .for_each(|(chunk, rows)| {
                for (row, out) in rows.chunks_mut(self.width).enumerate() {
                    fill(chunk * ROWS + row, out);
                }
            });
    }

    /// Row `y` of the operator applied to `x`.
    #[inline]
    fn row(&self, x: &[f32], y: usize, out: &mut [f32]) {
        let n = self.width;
        let row = y * n..(y + 1) * n;
        let (here, wx) = (&x[row.clone()], &self.wx[row.clone()]);
        for ((out, v), x) in out.iter_mut().zip(&self.v[row.clone()]).zip(here) {
            *out = v * x;
        }
        if y > 0 {
            let above = row.start - n..row.end - n;
            add_difference(out, &self.wy[above.clone()], here, &x[above]);
        }
        if y + 1 < self.height {
            let below = row.start + n..row.end + n;
            add_difference(out, &self.wy[row], here, &x[below]);
        }
        add_difference(&mut out[1..], wx, &here[1..], here);
        add_difference(&mut out[..n - 1], wx, here, &here[1..]);
    }

    /// out = (v + Dᵀ w D) x
    pub(super) fn apply(&self, x: &[f32], out: &mut [f32]) {
        self.by_rows(out, |y, out| self.row(x, y, out));
    }

    /// out = b − (v + Dᵀ w D) x
    pub(super) fn residual(&self, x: &[f32], b: &[f32], out: &mut [f32]) {
        self.by_rows(out, |y, out| {
            self.row(x, y, out);
            let b = &b[y * self.width..];
            out.iter_mut().zip(b).for_each(|(r, b)| *r = b - *r);
        });
    }

    /// The right side of the normal equations: v P + Dᵀ w G.
    pub(super) fn right_side(&self, primal: &[f32], dx: &[f32], dy: &[f32]) -> Vec<f32> {
        let n = self.width;
        let mut b = vec![0.0; primal.len()];
        self.by_rows(&mut b, |y, out| {
            let row = y * n..(y + 1) * n;
            for (i, out) in row.clone().zip(out.iter_mut()) {
                *out = self.v[i] * primal[i] - self.wx[i] * dx[i] - self.wy[i] * dy[i];
            }
            for (i, out) in row.clone().zip(&mut out[1..]) {
                *out += self.wx[i] * dx[i];
            }
            if y > 0 {
                for (i, out) in (row.start - n..row.end - n).zip(out) {
                    *out += self.wy[i] * dy[i];
                }
            }
        });
        b
    }

    /// The operator on cells of twice the side.
    fn coarser(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        // Sums over the fine cells of each coarse one; of differences those that cross its border.
        let gather = |weights: &[f32], share: f32, (across, along): (bool, bool)| {
            let mut out = vec![0.0; width * height];
            out.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
                let first = 2 * y + usize::from(along);
                for row in first..(2 * y + 2).min(self.height) {
                    let row = &weights[row * self.width..(row + 1) * self.width];
                    for (out, pair) in out.iter_mut().zip(row.chunks(2)) {
                        let second = pair.get(1).copied().unwrap_or(0.0);
                        *out += share * if across { second } else { pair[0] + second };
                    }
                }
            });
            out
        };
        let v = gather(&self.v, 1.0, (false, false));
        let wx = gather(&self.wx, CROSSING_SHARE, (true, false));
        let wy = gather(&self.wy, CROSSING_SHARE, (false, true));
        Self::new(width, v, wx, wy)
    }
}

/// out += w (x − other)
#[inline]
fn add_difference(out: &mut [f32], w: &[f32], x: &[f32], other: &[f32]) {
    for (((out, w), x), other) in out.iter_mut().zip(w).zip(x).zip(other) {
        *out += w * (x - other);
    }
}

impl Multigrid {
    pub(super) fn new(operator: Operator) -> Self {
        let mut levels = Vec::new();
        let mut next = Some(operator);
        while let Some(operator) = next {
            next = (operator.v.len() > 1).then(|| operator.coarser());
            let room = || vec![0.0; operator.v.len()];
            levels.push(Level {
                b: if levels.is_empty() {
                    Vec::new()
                } else {
                    room()
                },
                x: room(),
                r: room(),
                operator,
            });
        }
        Self { levels }
    }

    /// The operator of the finest level.
    pub(super) fn operator(&self) -> &Operator {
        &self.levels[0].operator
    }

    /// One cycle: what it makes of the right side `b`, approximately the solution.
    pub(super) fn precondition(&mut self, b: &[f32]) -> &[f32] {
        let (finest, coarser) = self.levels.split_first_mut().expect("there is a level");
        cycle(&finest.operator, &mut finest.x, &mut finest.r, b, coarser);
        &finest.x
    }
}

/// One cycle for `operator`: x from b.
fn cycle(
    operator: &Operator,
    x: &mut Vec<f32>,
    r: &mut Vec<f32>,
    b: &[f32],
    coarser: &mut [Level],
) {
    let n = operator.width;
    let Some((coarse, below)) = coarser.split_first_mut() else {
        // A single cell: exact.
        x[0] = b[0] * operator.inverse[0];
        return;
    };
    // A step from 0.
    operator.by_rows(x, |y, out| {
        let row = y * n..(y + 1) * n;
        for ((x, b), d) in out
            .iter_mut()
            .zip(&b[row.clone()])
            .zip(&operator.inverse[row])
        {
            *x = DAMPING * b * d;
        }
    });
    operator.residual(x, b, r);
    restrict(
        r,
        (n, operator.height),
        &mut coarse.b,
        coarse.operator.width,
    );
    cycle(
        &coarse.operator,
        &mut coarse.x,
        &mut coarse.r,
        &coarse.b,
        below,
    );
    prolong(&coarse.x, coarse.operator.width, x, (n, operator.height));
    // A step after.
    operator.by_rows(r, |y, out| {
        operator.row(x, y, out);
        let row = y * n..(y + 1) * n;
        let sides = b[row.clone()].iter().zip(&x[row.clone()]);
        for ((r, (b, x)), d) in out.iter_mut().zip(sides).zip(&operator.inverse[row]) {
            *r = x + DAMPING * d * (b - *r);
        }
    });
    std::mem::swap(x, r);
}

/// The coarse cells that a fine one takes its value from: its own by ¾, the nearer neighbour by ¼; at the
/// border its own alone.
#[inline]
fn neighbours(fine: usize, coarse_len: usize) -> (usize, usize) {
    let own = fine / 2;
    let other = if fine.is_multiple_of(2) {
        own.saturating_sub(1)
    } else {
        (own + 1).min(coarse_len - 1)
    };
    (own, other)
}

/// x += P e: bilinear.
fn prolong(e: &[f32], coarse_width: usize, x: &mut [f32], (width, _): (usize, usize)) {
    let coarse_height = e.len() / coarse_width;
    x.par_chunks_mut(width * ROWS).enumerate().for_each_init(
        || vec![0.0; coarse_width],
        |line, (chunk, rows)| {
            for (row, out) in rows.chunks_mut(width).enumerate() {
                let (own, other) = neighbours(chunk * ROWS + row, coarse_height);
                let at = |row: usize| &e[row * coarse_width..(row + 1) * coarse_width];
                for ((l, a), b) in line.iter_mut().zip(at(own)).zip(at(other)) {
                    *l = 0.75 * a + 0.25 * b;
                }
                for (column, pair) in out.chunks_mut(2).enumerate() {
                    let left = line[column.saturating_sub(1)];
                    let right = line[(column + 1).min(coarse_width - 1)];
                    pair[0] += 0.75 * line[column] + 0.25 * left;
                    if let Some(x) = pair.get_mut(1) {
                        *x += 0.75 * line[column] + 0.25 * right;
                    }
                }
            }
        },
    );
}

/// b = Pᵀ r.
fn restrict(r: &[f32], (width, height): (usize, usize), b: &mut [f32], coarse_width: usize) {
    let coarse_height = b.len() / coarse_width;
    // How much the fine cell `fine` gives to the coarse cell `coarse`.
    let share = |fine: usize, coarse: usize, len: usize| {
        let (own, other) = neighbours(fine, len);
        0.75 * f32::from(own == coarse) + 0.25 * f32::from(other == coarse)
    };
    b.par_chunks_mut(coarse_width * ROWS)
        .enumerate()
        .for_each_init(
            || vec![0.0; width],
            |line, (chunk, rows)| {
                for (row, out) in rows.chunks_mut(coarse_width).enumerate() {
                    let coarse = chunk * ROWS + row;
                    // Rows first.
                    line.fill(0.0);
                    let first = (2 * coarse).saturating_sub(1);
                    for fine in first..(2 * coarse + 3).min(height) {
                        let s = share(fine, coarse, coarse_height);
                        let r = &r[fine * width..(fine + 1) * width];
                        line.iter_mut().zip(r).for_each(|(l, r)| *l += s * r);
                    }
                    for (column, out) in out.iter_mut().enumerate() {
                        let first = (2 * column).saturating_sub(1);
                        let inside = column > 0 && 2 * column + 2 < width;
                        *out = if inside {
                            0.75 * (line[2 * column] + line[2 * column + 1])
                                + 0.25 * (line[first] + line[2 * column + 2])
                        } else {
                            (first..(2 * column + 3).min(width))
                                .map(|fine| share(fine, column, coarse_width) * line[fine])
                                .sum()
                        };
                    }
                }
            },
        );
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Restriction is the transpose of prolongation, so that a cycle is symmetric.
    #[test]
    fn transfers_are_transposes() {
        for (width, height) in [(1usize, 1usize), (1, 7), (6, 1), (2, 2), (5, 4), (37, 23)] {
            let (cw, ch) = (width.div_ceil(2), height.div_ceil(2));
            let value =
                |i: usize, k: usize| ((i * 7919 + k * 104_729) % 1000) as f32 / 1000.0 - 0.5;
            let fine: Vec<f32> = (0..width * height).map(|i| value(i, 1)).collect();
            let coarse: Vec<f32> = (0..cw * ch).map(|i| value(i, 2)).collect();
            let mut up = vec![0.0; width * height];
            prolong(&coarse, cw, &mut up, (width, height));
            let mut down = vec![0.0; cw * ch];
            restrict(&fine, (width, height), &mut down, cw);
            let dot = |a: &[f32], b: &[f32]| -> f32 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
            let difference = dot(&up, &fine) - dot(&coarse, &down);
            assert!(difference.abs() < 1e-4, "{width}x{height}: {difference}");
        }
    }

    /// A constant is carried up unchanged.
    #[test]
    fn prolongation_keeps_constants() {
        let mut x = vec![0.0; 7 * 5];
        prolong(&[2.0; 4 * 3], 4, &mut x, (7, 5));
        assert!(x.iter().all(|&x| (x - 2.0).abs() < 1e-6));
    }
}
