//! Light from apertures, fibres and volumes in whole scenes. Three estimators are compared with
//! each other, and fractions of power through discs and the radiance of volumes with closed forms.
//!
//! Statistical tests compare at a family-wise false-alarm rate of 1.1e-4 each: at most 1e-3 for all
//! twelve.

mod agreement;
mod media;
mod shares;
mod support;
mod volumes;
