//! `ravenpose infer`: the service's own plan on rows of a CSV file. Each row stands for itself, as in any ONNX runtime that is given
//! the 118 features alone; with `--in-order` a model's memory goes from row to row as in the service.

use crate::output;
use ravenpose::correction::{Estimator, Quantity};
use ravenpose::model::{self, Estimate};
use ravenpose::network::{Format, choose};
use std::path::Path;
use std::process::ExitCode;

const INPUTS: usize = 118;

pub(crate) fn run(model_path: &Path, input: &Path, out: &Path, weights: &str, in_order: bool) -> Result<ExitCode, String> {
    let format: Format = weights.parse().map_err(|error| format!("--weights: {error}"))?;
    output::check_file(out, &[model_path, input])?;
    let network = model::network(model_path).map_err(|error| error.to_string())?;
    let choice =
        choose(&network, &[], f64::INFINITY, Some(format)).map_err(|error| format!("{}: {error}", model_path.display()))?;
    let mut estimate = Estimate::new(&network, choice.plan);
    if format != Format::F32 {
        let unit = Quantity::of_card(&network.metadata).unwrap_or_default().thousandth();
        complain!(
            "weights {format}: at most {:.2} {unit} from float64, {:.2} {unit} RMS, over {} random inputs",
            choice.deviation.worst * 1000.0,
            choice.deviation.rms * 1000.0,
            choice.deviation.inputs
        );
    }
    let name = input.display();
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_path(input)
        .map_err(|cause| format!("{name}: cannot be read: {cause}; give a CSV file with columns in_0..in_117"))?;
    let columns = columns(&name.to_string(), &mut reader)?;
    output::whole(out, |file| {
        let failed = |cause: std::io::Error| format!("{}: cannot be written: {cause}", out.display());
        writeln!(file, "out_0,out_1,out_2").map_err(failed)?;
        let mut record = csv::StringRecord::new();
        let mut rows = 0_u64;
        while reader.read_record(&mut record).map_err(|cause| format!("{name}: {}; make all rows alike", one_line(&cause)))? {
            let line = record.position().map_or(0, csv::Position::line);
            let features = features(&name.to_string(), line, &columns, &record)?;
            let mut error = [0.0_f32; 3];
            if !in_order {
                estimate.forget();
            }
            // A period apart, as states are.
            estimate.follow(&features, rows as i64 * 1_000_000);
            estimate.run(&features, &mut error);
            if let Some(value) = error.iter().find(|value| !value.is_finite()) {
                return Err(format!(
                    "{name}:{line}: the network's output is {value}; the row is far outside what it was trained on"
                ));
            }
            writeln!(file, "{},{},{}", error[0], error[1], error[2]).map_err(failed)?;
            rows += 1;
        }
        if rows == 0 {
            return Err(format!("{name}: no rows after the header; nothing to do"));
        }
        Ok(())
    })?;
    Ok(ExitCode::SUCCESS)
}

fn one_line(error: &csv::Error) -> String {
    error.to_string().lines().collect::<Vec<_>>().join(" ")
}

/// The position of in_0..in_117 in the header.
fn columns(name: &str, reader: &mut csv::Reader<std::fs::File>) -> Result<Vec<usize>, String> {
    let header = reader.headers().map_err(|cause| format!("{name}:1: {}; save the file as UTF-8 CSV", one_line(&cause)))?;
    (0..INPUTS)
        .map(|input| {
            let wanted = format!("in_{input}");
            let mut found = header.iter().enumerate().filter(|(_, column)| **column == wanted);
            match (found.next(), found.next()) {
                (Some((at, _)), None) => Ok(at),
                (None, _) => Err(format!("{name}:1: column {wanted} is missing; the model wants in_0..in_117")),
                (Some(_), Some(_)) => Err(format!("{name}:1: column {wanted} is there twice; keep one")),
            }
        })
        .collect()
}

fn features(name: &str, line: u64, columns: &[usize], record: &csv::StringRecord) -> Result<[f32; INPUTS], String> {
    let mut features = [0.0; INPUTS];
    for (input, (to, &column)) in features.iter_mut().zip(columns).enumerate() {
        let cell = record.get(column).unwrap_or("");
        match cell.parse::<f32>() {
            Ok(value) if value.is_finite() => *to = value,
            Ok(value) => return Err(format!("{name}:{line}: in_{input} is {value}; inputs must be finite, remove the row")),
            Err(_) => return Err(format!("{name}:{line}: in_{input} is {cell:?}, not a number; correct or remove the row")),
        }
    }
    Ok(features)
}
