//! A small symmetric system.

/// Solves a symmetric positive system by Cholesky's factors.
pub(crate) fn solve<const N: usize>(a: &[[f64; N]; N], b: &[f64; N]) -> [f64; N] {
    let mut l = *a;
    let mut x = *b;
    for j in 0..N {
        for k in 0..j {
            l[j][j] -= l[j][k] * l[j][k];
        }
        l[j][j] = l[j][j].sqrt();
        for i in j + 1..N {
            for k in 0..j {
                l[i][j] -= l[i][k] * l[j][k];
            }
            l[i][j] /= l[j][j];
        }
        for k in 0..j {
            x[j] -= l[j][k] * x[k];
        }
        x[j] /= l[j][j];
    }
    for j in (0..N).rev() {
        for k in j + 1..N {
            x[j] -= l[k][j] * x[k];
        }
        x[j] /= l[j][j];
    }
    x
}
