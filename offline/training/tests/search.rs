//! The search for a recipe: rungs, stopping and going on, refusals.
#![allow(missing_docs)]

mod common;

use common::{Folder, runs, small};
use std::path::{Path, PathBuf};
use training::data::Reading;
use training::preset::Recipe;
use training::search::{BEST, TRIALS, Trial, Wish, draw, rungs, search};

fn wish<'a>(data: &'a [PathBuf], reading: &'a Reading, base: &'a Recipe, out: &'a Path) -> Wish<'a> {
    Wish { data, reading, base, trials: 6, epochs: 1, every: 3, out }
}

/// What does not depend on the machine.
fn without_times(trials: &[Trial]) -> Vec<Trial> {
    trials.iter().map(|trial| Trial { seconds: 0.0, ..trial.clone() }).collect()
}

#[test]
fn a_third_goes_on_and_the_best_of_the_last_rung_is_written() {
    assert_eq!(rungs(100), [100, 33, 11, 3, 1]);
    assert_eq!(rungs(1), [1]);
    let folder = Folder::new("search");
    let files = runs(&folder, 3, 2.0, ".mcap");
    let (reading, base, out) = (Reading::default(), Recipe { seed: 4, ..small("one-state") }, folder.file("out"));
    let mut heard = 0;
    let trials = search(&wish(&files, &reading, &base, &out), &mut |_, all| {
        heard += 1;
        assert_eq!(all, 9);
    })
    .expect("searched");
    assert_eq!((heard, trials.len()), (9, 9));
    for (rung, epochs) in [(0, 1), (1, 3), (2, 9)] {
        let here: Vec<&Trial> = trials.iter().filter(|trial| trial.rung == rung).collect();
        assert!(here.iter().all(|trial| trial.recipe.epochs == epochs));
        let rms: Vec<f64> = here.iter().map(|trial| trial.validation_rms.unwrap_or(f64::INFINITY)).collect();
        assert!(rms.is_sorted(), "{rms:?}");
        // Those that went on are the first of the rung before.
        let mut went: Vec<usize> = here.iter().map(|trial| trial.index).collect();
        if rung > 0 {
            let before: Vec<usize> = trials.iter().filter(|trial| trial.rung == rung - 1).map(|trial| trial.index).collect();
            went.sort_unstable();
            let mut best = before[..went.len()].to_vec();
            best.sort_unstable();
            assert_eq!(went, best);
        }
    }
    let best: Recipe = serde_json::from_slice(&std::fs::read(out.join(BEST)).expect("best")).expect("recipe");
    assert_eq!(best, draw(&base, trials.last().expect("trial").index));
    assert_eq!(best.epochs, base.epochs);
}

#[test]
fn a_search_that_was_cut_off_goes_on_to_the_same_end() {
    let folder = Folder::new("cut");
    let files = runs(&folder, 3, 2.0, ".mcap");
    let (reading, base, out) = (Reading::default(), small("one-state"), folder.file("out"));
    let through = search(&wish(&files, &reading, &base, &out), &mut |_, _| {}).expect("searched");
    let text = std::fs::read_to_string(out.join(TRIALS)).expect("trials");
    // The header and four trainings are whole, the fifth is cut.
    let end = text.lines().take(5).map(|line| line.len() + 1).sum::<usize>() + 20;
    std::fs::write(out.join(TRIALS), &text[..end]).expect("cut");
    std::fs::remove_file(out.join(BEST)).expect("best");
    let again = search(&wish(&files, &reading, &base, &out), &mut |_, _| {}).expect("searched");
    assert_eq!(without_times(&through), without_times(&again));
    let kept = |text: &str| text.lines().take(5).map(str::to_owned).collect::<Vec<_>>();
    let now = std::fs::read_to_string(out.join(TRIALS)).expect("trials");
    assert_eq!(kept(&now), kept(&text), "finished trainings are not done again");
    assert_eq!(now.lines().count(), 10);
}

#[test]
fn a_folder_of_another_search_is_refused() {
    let folder = Folder::new("other");
    let files = runs(&folder, 3, 2.0, ".mcap");
    let (reading, base, out) = (Reading::default(), small("one-state"), folder.file("out"));
    let _ = search(&wish(&files, &reading, &base, &out), &mut |_, _| {}).expect("searched");
    let before = std::fs::read(out.join(TRIALS)).expect("trials");
    let other = Recipe { seed: 9, ..base };
    let line = search(&wish(&files, &reading, &other, &out), &mut |_, _| {}).expect_err("another seed").to_string();
    assert!(line.contains("belongs to another run") && line.lines().count() == 1, "{line}");
    assert_eq!(std::fs::read(out.join(TRIALS)).expect("trials"), before);
}

#[test]
fn recipes_are_drawn_from_the_whole_range_and_by_their_number_alone() {
    let base = small("default");
    let all: Vec<Recipe> = (0..200).map(|index| draw(&base, index)).collect();
    assert_eq!(all[17], draw(&base, 17));
    for layers in 1..=4 {
        assert!(all.iter().any(|recipe| recipe.hidden.len() == layers));
    }
    let widths: Vec<usize> = all.iter().flat_map(|recipe| recipe.hidden.clone()).collect();
    assert_eq!((widths.iter().min(), widths.iter().max()), (Some(&100), Some(&600)));
    let rates: Vec<f64> = all.iter().map(|recipe| recipe.rate).collect();
    assert!(rates.iter().all(|rate| (3e-4..=1e-2).contains(rate)));
    assert!(rates.iter().any(|rate| *rate < 6e-4) && rates.iter().any(|rate| *rate > 5e-3));
    assert!(all.iter().all(|recipe| recipe.memory));
}

#[test]
fn tables_are_searched_too() {
    let folder = Folder::new("search-tables");
    let table = |k: usize| {
        let row = |t: usize| {
            let x = (0.7123 * k as f64 + (t * (k + 3)) as f64 * 0.01).sin();
            format!("{},{x},{}", t as f64 * 0.01, 2.0 * x + 0.1 * x * x)
        };
        folder.text(
            &format!("run_{k}.csv"),
            &(std::iter::once("t_s,a,out".to_owned()).chain((0..300).map(row)).collect::<Vec<_>>().join("\n") + "\n"),
        )
    };
    let files: Vec<PathBuf> = (0..3).map(table).collect();
    let columns = training::data::Columns { inputs: vec!["a".to_owned()], truth: vec!["out".to_owned()], ..Default::default() };
    let reading = Reading { columns: Some(columns), ..Reading::default() };
    let (base, out) = (Recipe::ours().for_tables(), folder.file("out"));
    let trials = search(&wish(&files, &reading, &base, &out), &mut |_, _| {}).expect("searched");
    assert!(trials.iter().all(|trial| trial.recipe.preparation == training::prepare::Preparation::Standard));
}
