//! Position and irradiance of the sun.

use glam::DVec3;
use std::f64::consts::TAU;

/// Place on the earth, with date and local time.
pub(super) struct Observer {
    /// Latitude in degrees, positive to the north.
    pub latitude: f64,
    /// Longitude in degrees, positive to the east.
    pub longitude: f64,
    /// Time zone, in hours ahead of universal time.
    pub timezone: f64,
    pub year: i64,
    /// Month, 1 to 12.
    pub month: i64,
    /// Day of the month, 1 to 31.
    pub day: i64,
    /// Local time in hours after midnight.
    pub hours: f64,
}

/// Mean radius of the earth divided by the distance to the sun.
const PARALLAX: f64 = 6371.01 / 149_597_890.0;

impl Observer {
    /// Returns the unit direction to the sun in the axes of Mitsuba's `sunsky`: z up, −x to the
    /// north, −y to the east. It follows the solar vector of Blanco-Muriel et al. (2001), which is
    /// accurate to about 0.01° from 1999 to 2015.
    pub(super) fn sun(&self) -> DVec3 {
        let hours = self.hours - self.timezone;
        let days = self.day_number() as f64 - 0.5 + hours / 24.0 - 2_451_545.0;
        let [right_ascension, declination] = celestial(days);
        let sidereal = 6.697_424_324_2 + 0.065_709_828_3 * days + hours;
        let hour_angle = (sidereal * 15.0 + self.longitude).to_radians() - right_ascension;
        let (sin_latitude, cos_latitude) = self.latitude.to_radians().sin_cos();
        let (sin, cos) = declination.sin_cos();
        let height = cos_latitude * hour_angle.cos() * cos + sin * sin_latitude;
        let zenith = height.clamp(-1.0, 1.0).acos();
        let zenith = zenith + PARALLAX * zenith.sin();
        let north = declination.tan() * cos_latitude - sin_latitude * hour_angle.cos();
        let azimuth = (-hour_angle.sin()).atan2(north);
        let level = DVec3::new(azimuth.cos(), azimuth.sin(), 0.0);
        (-zenith.sin() * level).with_z(zenith.cos())
    }

    /// Returns the Julian day number of the date (Fliegel and Van Flandern 1968).
    fn day_number(&self) -> i64 {
        let early = (self.month - 14) / 12;
        (1461 * (self.year + 4800 + early)) / 4 + (367 * (self.month - 2 - 12 * early)) / 12
            - (3 * ((self.year + 4900 + early) / 100)) / 4
            + self.day
            - 32_075
    }
}

/// Returns right ascension and declination of the sun in radians, `days` after noon of 1 January
/// 2000.
fn celestial(days: f64) -> [f64; 2] {
    let omega = 2.1429 - 0.001_039_459_4 * days;
    let anomaly = 6.240_060 + 0.017_201_969_9 * days;
    let longitude = 4.895_063
        + 0.017_202_791_698 * days
        + 0.033_416_07 * anomaly.sin()
        + 0.000_348_94 * (2.0 * anomaly).sin()
        - 0.000_113_4
        - 0.000_020_3 * omega.sin();
    let obliquity = 0.409_092_8 - 6.214e-9 * days + 0.000_039_6 * omega.cos();
    let (sin, cos) = longitude.sin_cos();
    let right_ascension = (obliquity.cos() * sin).atan2(cos).rem_euclid(TAU);
    [right_ascension, (obliquity.sin() * sin).asin()]
}

/// Elevations in degrees of the columns of [`IRRADIANCE`].
const ELEVATIONS: [f64; 8] = [2.0, 5.0, 8.0, 14.0, 23.0, 38.0, 62.0, 89.0];

/// Irradiance by the sun, perpendicular to its direction, in linear sRGB. The unit is W/(m² nm),
/// averaged over the eye's response. The rows are turbidities 1 to 10, the columns [`ELEVATIONS`].
/// Mitsuba 3.9.1 (`scalar_rgb`) computed the values from the solar radiances of Hosek and Wilkie
/// (2013). Negative values are set to 0.
const IRRADIANCE: [[[f64; 3]; 8]; 10] = [
    [
        [0.4848, 0.1382, 0.0],
        [0.8491, 0.3883, 0.05176],
        [1.063, 0.6017, 0.1671],
        [1.278, 0.8722, 0.4028],
        [1.412, 1.073, 0.6478],
        [1.5, 1.218, 0.8634],
        [1.548, 1.302, 1.005],
        [1.561, 1.326, 1.047],
    ],
    [
        [0.3845, 0.1073, 0.0],
        [0.7646, 0.3464, 0.04645],
        [0.9946, 0.5592, 0.1559],
        [1.229, 0.8359, 0.3869],
        [1.378, 1.045, 0.6317],
        [1.477, 1.198, 0.8497],
        [1.532, 1.287, 0.9942],
        [1.547, 1.312, 1.037],
    ],
    [
        [0.2623, 0.07085, 0.0],
        [0.643, 0.2867, 0.03873],
        [0.8908, 0.4956, 0.139],
        [1.153, 0.7794, 0.3619],
        [1.325, 1.001, 0.6062],
        [1.441, 1.165, 0.8277],
        [1.505, 1.263, 0.9762],
        [1.523, 1.29, 1.021],
    ],
    [
        [0.1398, 0.03568, 0.0],
        [0.4835, 0.2101, 0.02879],
        [0.7428, 0.4065, 0.115],
        [1.038, 0.6946, 0.3243],
        [1.242, 0.9318, 0.5663],
        [1.382, 1.113, 0.7926],
        [1.463, 1.223, 0.9472],
        [1.485, 1.254, 0.9937],
    ],
    [
        [0.06961, 0.01665, 0.0],
        [0.3547, 0.1499, 0.02087],
        [0.6102, 0.3278, 0.09354],
        [0.9266, 0.6131, 0.288],
        [1.157, 0.8624, 0.526],
        [1.322, 1.06, 0.7566],
        [1.418, 1.182, 0.9168],
        [1.445, 1.217, 0.9655],
    ],
    [
        [0.0401, 0.009138, 0.0],
        [0.2824, 0.1169, 0.01647],
        [0.5292, 0.2805, 0.08073],
        [0.8539, 0.5605, 0.2644],
        [1.101, 0.8157, 0.4989],
        [1.281, 1.023, 0.7316],
        [1.387, 1.153, 0.8957],
        [1.417, 1.191, 0.9457],
    ],
    [
        [0.01618, 0.003392, 0.0],
        [0.1942, 0.07763, 0.01114],
        [0.4183, 0.2169, 0.06319],
        [0.7463, 0.4833, 0.2296],
        [1.012, 0.7441, 0.4572],
        [1.215, 0.9651, 0.6923],
        [1.337, 1.107, 0.8619],
        [1.372, 1.149, 0.9142],
    ],
    [
        [0.003666, 0.0006685, 0.0],
        [0.1046, 0.03953, 0.005837],
        [0.2838, 0.142, 0.04218],
        [0.5973, 0.3785, 0.182],
        [0.8824, 0.6395, 0.396],
        [1.114, 0.8766, 0.6318],
        [1.258, 1.035, 0.8086],
        [1.3, 1.083, 0.8642],
    ],
    [
        [0.0003247, 4.737e-05, 0.0],
        [0.03767, 0.01297, 0.002023],
        [0.1496, 0.07048, 0.02162],
        [0.4135, 0.2528, 0.1239],
        [0.7033, 0.4981, 0.3122],
        [0.9643, 0.748, 0.5434],
        [1.139, 0.9266, 0.728],
        [1.19, 0.9818, 0.7877],
    ],
    [
        [6.204e-06, 4.963e-07, 0.0],
        [0.006994, 0.002063, 0.0003543],
        [0.052, 0.0222, 0.007198],
        [0.2255, 0.1299, 0.0658],
        [0.4836, 0.3297, 0.2109],
        [0.7606, 0.5755, 0.4239],
        [0.965, 0.772, 0.612],
        [1.029, 0.8354, 0.676],
    ],
];

/// Returns the sun's irradiance across its direction in linear sRGB, at an `elevation` in radians,
/// through a sky with a `turbidity` from 1 to 10. Interpolation is linear in turbidity; the cube
/// root of the irradiance is linear in the logarithm of the sine of the elevation. The error is
/// within 1 % of the brightest sun. Elevations are clamped to 2° and 89°.
pub(super) fn irradiance(turbidity: f64, elevation: f64) -> [f64; 3] {
    let row = ((turbidity - 1.0) as usize).min(IRRADIANCE.len() - 2);
    let t = turbidity - 1.0 - row as f64;
    let [clear, hazy] = [row, row + 1].map(|row| at_elevation(&IRRADIANCE[row], elevation));
    std::array::from_fn(|c| (1.0 - t) * clear[c] + t * hazy[c])
}

/// Interpolates a row of [`IRRADIANCE`] at an elevation in radians.
fn at_elevation(row: &[[f64; 3]; 8], elevation: f64) -> [f64; 3] {
    let last = ELEVATIONS.len() - 1;
    let degrees = elevation
        .to_degrees()
        .clamp(ELEVATIONS[0], ELEVATIONS[last]);
    let i = ELEVATIONS.partition_point(|e| *e <= degrees).clamp(1, last) - 1;
    let log = |degrees: f64| libm::log(libm::sin(degrees.to_radians()));
    let [below, here, above] = [ELEVATIONS[i], degrees, ELEVATIONS[i + 1]].map(log);
    let t = (here - below) / (above - below);
    std::array::from_fn(|c| {
        let root = (1.0 - t) * libm::cbrt(row[i][c]) + t * libm::cbrt(row[i + 1][c]);
        root * root * root
    })
}
