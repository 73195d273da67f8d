//! Runs tract so that its panics become refusals.

use std::any::Any;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, set_hook, take_hook};
use std::sync::{Arc, Mutex, PoisonError};

use crate::error::ImportError;
use crate::text;

type Hook = Box<dyn Fn(&PanicHookInfo<'_>) + Send + Sync>;

/// The hook belongs to the whole process, so only one import may exchange it at a time.
static HOOK: Mutex<()> = Mutex::new(());

/// Runs `work`; a panic inside it becomes [`ImportError::Panicked`] and prints nothing.
pub(crate) fn guarded<T>(work: impl FnOnce() -> Result<T, ImportError>) -> Result<T, ImportError> {
    let _one_at_a_time = HOOK.lock().unwrap_or_else(PoisonError::into_inner);
    let previous: Arc<Hook> = Arc::new(take_hook());
    let outer = Arc::clone(&previous);
    let importing = std::thread::current().id();
    // Only this thread is silenced: another thread's panic is a bug that must be seen.
    set_hook(Box::new(move |info| {
        if std::thread::current().id() != importing {
            outer(info);
        }
    }));
    let outcome = catch_unwind(AssertUnwindSafe(work));
    drop(take_hook());
    // Unwrapped, not wrapped once more: thousands of imports must not build a tower of hooks.
    match Arc::try_unwrap(previous) {
        Ok(hook) => set_hook(hook),
        // Another thread is inside the hook this very moment; a wrapper keeps its behaviour.
        Err(shared) => set_hook(Box::new(move |info| shared(info))),
    }
    outcome.unwrap_or_else(|payload| Err(ImportError::Panicked { reason: text::reason(message(&*payload)) }))
}

fn message(payload: &(dyn Any + Send)) -> &str {
    payload.downcast_ref::<String>().map(String::as_str).or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("no message")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_one_line() {
        let refused = guarded(|| -> Result<(), _> { panic!("first\nsecond {}", 2) });
        assert_eq!(refused, Err(ImportError::Panicked { reason: "first\\nsecond 2".to_owned() }));
    }
}
