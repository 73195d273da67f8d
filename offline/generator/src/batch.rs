//! Many cases on several threads, and the manifest over them.

use crate::order::Order;
use crate::seal;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Makes every case that does not stand yet, then the manifest. What is made does not depend on `jobs`.
///
/// # Errors
///
/// The first case that could not be made; a truth that is no longer what was published.
pub fn make(orders: &[Order], out: &Path, jobs: usize) -> Result<(), String> {
    std::fs::create_dir_all(out).map_err(|error| format!("{}: {error}", out.display()))?;
    unchanged(out)?;
    let (next, troubles) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..jobs.max(1) {
            scope.spawn(|| {
                while let Some(order) = orders.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if order.is_done(out) {
                        continue;
                    }
                    if let Err(trouble) = order.write(out)
                        && let Ok(mut troubles) = troubles.lock()
                    {
                        troubles.push(format!("{}: {trouble}", order.label));
                    }
                }
            });
        }
    });
    if let Some(first) = troubles.into_inner().unwrap_or_default().first() {
        return Err(first.clone());
    }
    manifest(out).map_err(|error| format!("{}: {error}", out.display()))
}

/// Refuses to go on where a truth was changed after its hash was published: the manifest is written anew.
fn unchanged(out: &Path) -> Result<(), String> {
    let path = out.join("manifest.json");
    if !path.is_file() {
        return Ok(());
    }
    let trouble = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let published: serde_json::Value = std::fs::read(&path)
        .map_err(|error| trouble(&error))
        .and_then(|bytes| serde_json::from_slice(&bytes).map_err(|error| trouble(&error)))?;
    let sealed = seal::commitments(&out.join("sealed")).map_err(|error| trouble(&error))?;
    match sealed.iter().find(|(case, hash)| published["cases"].get(*case).is_some_and(|known| known != *hash)) {
        Some((case, _)) => Err(format!(
            "{}: not what the manifest says; it was changed after publication: begin another folder",
            out.join("sealed").join(case).with_extension("json").display()
        )),
        None => Ok(()),
    }
}

/// The public list of hashes, over every truth that stands in the folder.
fn manifest(out: &Path) -> std::io::Result<()> {
    let cases = seal::commitments(&out.join("sealed"))?;
    let manifest = serde_json::json!({
        "schema": "ravenpose-truth-manifest-1",
        "generator": concat!("ravenpose-generator ", env!("CARGO_PKG_VERSION")),
        "hash": "SHA-256 of the canonical JSON of each sealed truth",
        "cases": cases,
    });
    seal::write_whole(&out.join("manifest.json"), (seal::canonical(&manifest) + "\n").as_bytes())
}
