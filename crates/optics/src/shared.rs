//! Values that take long to make, made once for all who need the same.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Values by the content that they are made from, kept as long as someone holds them. Scenes, channels and threads share them.
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
    /// Without any value.
    pub const fn new() -> Self {
        Shared {
            made: Mutex::new(BTreeMap::new()),
        }
    }

    /// The value of a key, made if nobody holds it. `make` depends on the key alone. Threads that ask at the same time may both make it,
    /// and share that of the first.
    pub fn get(&self, key: K, make: impl FnOnce() -> V) -> Arc<V> {
        let made: Result<_, Infallible> = self.try_get(key, || Ok(make()));
        made.unwrap_or_else(|never| match never {})
    }

    /// The value of a key, as [`Shared::get`] finds it, unless making it fails.
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

/// Values that are held once even if they are made several times. They are kept as long as someone holds them.
#[derive(Debug)]
pub struct Distinct<V>(Mutex<Vec<Weak<V>>>);

impl<V> Default for Distinct<V> {
    fn default() -> Self {
        Distinct(Mutex::default())
    }
}

impl<V: PartialEq> Distinct<V> {
    /// Returns the value that equals `made` and is held by someone, or else `made` itself.
    pub fn one(&self, made: V) -> Arc<V> {
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
        // What nobody holds is forgotten, except for the last one.
        assert!(SQUARES.lock().len() <= 1);
    }

    #[test]
    fn equal_values_are_held_once() {
        let lists = Distinct::default();
        let first = lists.one(vec![1, 2]);
        assert!(Arc::ptr_eq(&first, &lists.one(vec![1, 2])));
        assert!(!Arc::ptr_eq(&first, &lists.one(vec![1, 3])));
        drop(first);
        assert_eq!(*lists.one(vec![1, 2]), [1, 2]);
        assert_eq!(lists.0.lock().unwrap().len(), 1);
    }
}
