//! The simplex method of Nelder and Mead (1965).

/// Least value of a function from a first point and first steps; ends when the simplex's values differ by less than `tolerance`.
pub fn minimise<const N: usize>(
    start: [f64; N],
    steps: [f64; N],
    evaluations: usize,
    tolerance: f64,
    function: impl Fn(&[f64; N]) -> f64,
) -> [f64; N] {
    let value = |x: &[f64; N]| {
        let v = function(x);
        if v.is_nan() { f64::INFINITY } else { v }
    };
    let mut corners = vec![(value(&start), start)];
    for k in 0..N {
        let mut x = start;
        x[k] += steps[k];
        corners.push((value(&x), x));
    }
    let mut spent = N + 1;
    while spent < evaluations {
        corners.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (best, worst) = (corners[0].0, corners[N].0);
        if worst - best < tolerance {
            break;
        }
        let middle: [f64; N] = std::array::from_fn(|k| corners[..N].iter().map(|c| c.1[k]).sum::<f64>() / N as f64);
        let along = |t: f64| -> [f64; N] { std::array::from_fn(|k| middle[k] + t * (corners[N].1[k] - middle[k])) };
        let reflected = along(-1.0);
        let at_reflected = value(&reflected);
        spent += 1;
        if at_reflected < best {
            let expanded = along(-2.0);
            let at_expanded = value(&expanded);
            spent += 1;
            corners[N] = if at_expanded < at_reflected { (at_expanded, expanded) } else { (at_reflected, reflected) };
            continue;
        }
        if at_reflected < corners[N - 1].0 {
            corners[N] = (at_reflected, reflected);
            continue;
        }
        let contracted = along(if at_reflected < worst { -0.5 } else { 0.5 });
        let at_contracted = value(&contracted);
        spent += 1;
        if at_contracted < worst.min(at_reflected) {
            corners[N] = (at_contracted, contracted);
            continue;
        }
        let top = corners[0].1;
        for corner in &mut corners[1..] {
            corner.1 = std::array::from_fn(|k| 0.5 * (top[k] + corner.1[k]));
            corner.0 = value(&corner.1);
        }
        spent += N;
    }
    corners.sort_by(|a, b| a.0.total_cmp(&b.0));
    corners[0].1
}
