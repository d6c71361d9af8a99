//! Caches of values that are expensive to compute and are shared by several users.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Cache of values by the key from which they are computed. A value stays in the cache as long as
/// an `Arc` to it exists. Scenes, channels and threads share the values.
#[derive(Debug)]
pub struct Shared<K, V> {
    made: Mutex<BTreeMap<K, Weak<V>>>,
}

impl<K, V> Default for Shared<K, V> {
    fn default() -> Self {
        Shared {
            made: Mutex::default(),
        }
    }
}

impl<K: Ord, V> Shared<K, V> {
    /// Creates an empty cache.
    pub const fn new() -> Self {
        Shared {
            made: Mutex::new(BTreeMap::new()),
        }
    }

    /// Returns the value of `key`. Computes it by `make` if the cache does not have it. `make` must
    /// depend on the key alone. Several threads may compute the value at the same time; all of them
    /// then share the first result.
    pub fn get(&self, key: K, make: impl FnOnce() -> V) -> Arc<V> {
        let made: Result<_, Infallible> = self.try_get(key, || Ok(make()));
        made.unwrap_or_else(|never| match never {})
    }

    /// Returns the value of `key` like [`Shared::get`], with a `make` that can fail.
    ///
    /// # Errors
    /// The error of `make`.
    pub fn try_get<E>(&self, key: K, make: impl FnOnce() -> Result<V, E>) -> Result<Arc<V>, E> {
        if let Some(value) = self.lock().get(&key).and_then(Weak::upgrade) {
            return Ok(value);
        }
        let value = Arc::new(make()?);
        let mut made = self.lock();
        if let Some(first) = made.get(&key).and_then(Weak::upgrade) {
            return Ok(first);
        }
        made.retain(|_, other| other.strong_count() > 0);
        made.insert(key, Arc::downgrade(&value));
        Ok(value)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, BTreeMap<K, Weak<V>>> {
        self.made.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Set of values that keeps only one copy of equal values. A value stays in the set as long as an
/// `Arc` to it exists.
#[derive(Debug)]
pub struct Distinct<V>(Mutex<Vec<Weak<V>>>);

impl<V> Default for Distinct<V> {
    fn default() -> Self {
        Distinct(Mutex::default())
    }
}

impl<V: PartialEq> Distinct<V> {
    /// Returns the value of the set that equals `made`. If there is none, adds `made` and returns
    /// it.
    pub fn intern(&self, made: V) -> Arc<V> {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        known.retain(|other| other.strong_count() > 0);
        let mut held = known.iter().filter_map(Weak::upgrade);
        if let Some(equal) = held.find(|other| **other == made) {
            return equal;
        }
        let value = Arc::new(made);
        known.push(Arc::downgrade(&value));
        value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_made_once_while_they_are_held() {
        static SQUARES: Shared<u64, u64> = Shared::new();
        let first = SQUARES.get(3, || 9);
        assert!(Arc::ptr_eq(&first, &SQUARES.get(3, || unreachable!())));
        assert_eq!(*SQUARES.get(4, || 16), 16);
        drop(first);
        assert_eq!(*SQUARES.get(3, || 10), 10);
        // The cache removes values without users, except the last one.
        assert!(SQUARES.lock().len() <= 1);
    }

    #[test]
    fn equal_values_are_held_once() {
        let lists = Distinct::default();
        let first = lists.intern(vec![1, 2]);
        assert!(Arc::ptr_eq(&first, &lists.intern(vec![1, 2])));
        assert!(!Arc::ptr_eq(&first, &lists.intern(vec![1, 3])));
        drop(first);
        assert_eq!(*lists.intern(vec![1, 2]), [1, 2]);
        assert_eq!(lists.0.lock().unwrap().len(), 1);
    }
}
