//! Work shared among the cores, its results in the order of its parts: they do not depend on how many cores there are.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{LazyLock, Mutex, PoisonError};

/// Cores that nobody works on: work within work takes what is left, and where nothing is left it is done where it stands.
static SPARE: LazyLock<AtomicUsize> = LazyLock::new(|| AtomicUsize::new(cores() - 1));

/// Cores that this program may use.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// What `work` makes of each item, in their order.
pub fn map<T: Send, R: Send, I>(items: impl IntoIterator<Item = T, IntoIter = I>, work: impl Fn(T) -> R + Sync) -> Vec<R>
where
    I: Iterator<Item = T> + Send,
{
    let items = items.into_iter();
    let helpers = Helpers::take(items.size_hint().1.unwrap_or(usize::MAX).saturating_sub(1));
    let queue = Mutex::new(items.enumerate());
    let take_part = || {
        let mut done = Vec::new();
        loop {
            let next = queue.lock().unwrap_or_else(PoisonError::into_inner).next();
            let Some((place, item)) = next else { return done };
            done.push((place, work(item)));
        }
    };
    let mut done = std::thread::scope(|scope| {
        let others: Vec<_> = (0..helpers.0).map(|_| scope.spawn(take_part)).collect();
        let mut done = take_part();
        for other in others {
            done.extend(other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        }
        done
    });
    done.sort_by_key(|(place, _)| *place);
    done.into_iter().map(|(_, result)| result).collect()
}

/// Both, at once where a core is spare.
pub fn both<A: Send, B: Send>(one: impl FnOnce() -> A + Send, other: impl FnOnce() -> B) -> (A, B) {
    let helpers = Helpers::take(1);
    if helpers.0 == 0 {
        return (one(), other());
    }
    std::thread::scope(|scope| {
        let one = scope.spawn(one);
        let other = other();
        (one.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)), other)
    })
}

/// So many of the spare cores, given back when dropped.
struct Helpers(usize);

impl Helpers {
    /// As many as there are, at most so many.
    fn take(most: usize) -> Self {
        let mut taken = 0;
        let _ = SPARE.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |spare| {
            taken = spare.min(most);
            Some(spare - taken)
        });
        Self(taken)
    }
}

impl Drop for Helpers {
    fn drop(&mut self) {
        let _ = SPARE.fetch_add(self.0, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_stand_in_the_order_of_the_items_whoever_made_them() {
        let squares = map(0..1000_u64, |k| {
            // The first ones take longest.
            let _ = std::hint::black_box((0..(1000 - k) * 20).fold(0, |sum, x| sum ^ x));
            k * k
        });
        assert!(squares.iter().enumerate().all(|(k, square)| *square == (k * k) as u64));
        assert!(map(Vec::<u8>::new(), |x| x).is_empty());
    }

    #[test]
    fn work_within_work_and_a_panic_give_the_cores_back() {
        let within = map(0..8_usize, |k| map(0..k, |i| i).iter().sum::<usize>());
        assert_eq!(within, [0, 0, 1, 3, 6, 10, 15, 21]);
        assert_eq!(both(|| 1, || map(0..3, |k| k)), (1, vec![0, 1, 2]));
        let panicked = std::panic::catch_unwind(|| map(0..4, |k| assert!(k < 2, "of item {k}")));
        assert!(panicked.is_err());
        // Other tests may be at work at the same time: in the end all are back.
        let all = (0..1000).any(|_| {
            std::thread::sleep(std::time::Duration::from_millis(5));
            SPARE.load(Ordering::Relaxed) == cores() - 1
        });
        assert!(all);
    }
}
