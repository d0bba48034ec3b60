//! Conversion between latitude and longitude and the local tangent plane of the missions.
//!
//! The datum is WGS84; positions are on the ellipsoid and heights are ignored. The plane touches the ellipsoid at an
//! origin. A point of the ellipsoid is projected orthogonally onto the plane, to metres east and north of the origin.
//! Therefore lengths along the distance d from the origin shrink by d²/(2 R²), where R is the radius of the Earth: by 1
//! mm per metre at 285 km, by 0.03 mm per metre at 50 km.
//!
//! The conversions are exact up to rounding, and use the library's sine, cosine and arctangent, so that the same file
//! gives the same bits on every platform.
//!
//! ```
//! use standoff_io::geodesy::LocalPlane;
//!
//! let plane = LocalPlane::about(44.5, 11.3)?;
//! let vehicle = plane.position(44.501, 11.301)?;
//! assert!((vehicle.x_m() - 79.53).abs() < 0.01 && (vehicle.y_m() - 111.12).abs() < 0.01);
//! let [latitude_deg, longitude_deg] = plane.degrees_at(vehicle)?;
//! assert!((latitude_deg - 44.501).abs() < 1e-9 && (longitude_deg - 11.301).abs() < 1e-9);
//! # Ok::<(), standoff_io::geodesy::GeodesyError>(())
//! ```

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use standoff::{Position, math};

/// Maximum distance from the origin, m. Further away, a plane is not a usable map of the Earth.
pub const FURTHEST_M: f64 = 1e6;

/// Equatorial radius of WGS84, m.
const EQUATORIAL_RADIUS_M: f64 = 6_378_137.0;
/// Flattening of WGS84.
const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// Square of the ratio of the polar to the equatorial radius.
const AXIS_RATIO_2: f64 = (1.0 - FLATTENING) * (1.0 - FLATTENING);

/// Earth-centred coordinates, m: x towards longitude 0, z towards the north pole.
type Geocentric = Vector3<f64>;

/// Unit of the coordinates of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Unit {
    /// Metres east and north.
    Metres,
    /// Degrees of longitude and latitude (WGS84), projected about the [`Origin`].
    Degrees,
}

/// Point on the WGS84 ellipsoid at which the local east-north plane of a file in degrees touches it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Origin {
    /// Latitude, degrees north, in [-90, 90].
    pub latitude_deg: f64,
    /// Longitude, degrees east, in [-180, 180].
    pub longitude_deg: f64,
}

impl Origin {
    /// Returns the plane. Fails if the origin is not a valid position.
    pub fn plane(self) -> Result<LocalPlane, GeodesyError> {
        LocalPlane::about(self.latitude_deg, self.longitude_deg)
    }
}

/// A coordinate outside the range in which it can be converted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{name} = {value}: must be at least {min} and at most {max}")]
pub struct GeodesyError {
    name: &'static str,
    /// The given value: degrees, or a distance in metres.
    pub value: f64,
    min: f64,
    max: f64,
}

/// The plane that touches the WGS84 ellipsoid at an origin; x is east, y is north.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalPlane {
    origin: Geocentric,
    /// Unit vectors.
    east: Vector3<f64>,
    north: Vector3<f64>,
    up: Vector3<f64>,
}

impl LocalPlane {
    /// Creates the plane around an origin: degrees north in [-90, 90], degrees east in [-180, 180]. Fails outside these
    /// ranges.
    pub fn about(latitude_deg: f64, longitude_deg: f64) -> Result<Self, GeodesyError> {
        let directions = directions(latitude_deg, longitude_deg)?;
        let ([(sin_lat, cos_lat), (sin_lon, cos_lon)], up) = (directions, normal(directions));
        Ok(Self {
            origin: on_ellipsoid(up),
            east: Vector3::new(-sin_lon, cos_lon, 0.0),
            north: Vector3::new(-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat),
            up,
        })
    }

    /// Converts latitude and longitude to a position in the plane: degrees north in [-90, 90], degrees east in [-180,
    /// 180]. Fails outside these ranges, and at a straight-line distance of more than [`FURTHEST_M`] from the origin.
    pub fn position(&self, latitude_deg: f64, longitude_deg: f64) -> Result<Position, GeodesyError> {
        let from_origin = on_ellipsoid(normal(directions(latitude_deg, longitude_deg)?)) - self.origin;
        check_distance(from_origin.norm())?;
        Ok(Position::from_m(self.east.dot(&from_origin), self.north.dot(&from_origin)))
    }

    /// Converts a position in the plane to latitude and longitude, degrees, of the point of the ellipsoid below it.
    /// Fails further than [`FURTHEST_M`] from the origin.
    pub fn degrees_at(&self, position: Position) -> Result<[f64; 2], GeodesyError> {
        check_distance(position.distance_m(Position::default()))?;
        let in_plane = self.origin + self.east * position.x_m() + self.north * position.y_m();
        // On the ellipsoid, the product of a point with itself is 1; `height_m` is the upper of both solutions.
        let product = |a: &Geocentric, b: &Geocentric| {
            (a.x * b.x + a.y * b.y + a.z * b.z / AXIS_RATIO_2) / EQUATORIAL_RADIUS_M / EQUATORIAL_RADIUS_M
        };
        let (half_slope, curvature) = (product(&in_plane, &self.up), product(&self.up, &self.up));
        let beyond = product(&in_plane, &in_plane) - 1.0;
        let height_m = ((half_slope * half_slope - curvature * beyond).sqrt() - half_slope) / curvature;
        let point = in_plane + self.up * height_m;
        let latitude_rad = math::atan2(point.z, AXIS_RATIO_2 * math::hypot(point.x, point.y));
        Ok([latitude_rad.to_degrees(), math::atan2(point.y, point.x).to_degrees()])
    }
}

/// The point of the ellipsoid with this unit normal.
fn on_ellipsoid(up: Vector3<f64>) -> Geocentric {
    let normal_m = EQUATORIAL_RADIUS_M / (1.0 - (1.0 - AXIS_RATIO_2) * up.z * up.z).sqrt();
    Vector3::new(up.x, up.y, AXIS_RATIO_2 * up.z) * normal_m
}

/// The unit vector that points up from sine and cosine of latitude and longitude.
fn normal([(sin_lat, cos_lat), (sin_lon, cos_lon)]: [(f64, f64); 2]) -> Vector3<f64> {
    Vector3::new(cos_lat * cos_lon, cos_lat * sin_lon, sin_lat)
}

/// Wraps the longitude of [longitude, latitude] to -180 to 180 degrees. Editors continue beyond that at the antimeridian.
#[must_use]
pub fn wrapped([longitude_deg, latitude_deg]: [f64; 2]) -> [f64; 2] {
    let turn_deg = if longitude_deg.abs() > 180.0 { 360.0_f64.copysign(longitude_deg) } else { 0.0 };
    [longitude_deg - turn_deg, latitude_deg]
}

/// Sine and cosine of latitude and longitude.
fn directions(latitude_deg: f64, longitude_deg: f64) -> Result<[(f64, f64); 2], GeodesyError> {
    check("latitude_deg", latitude_deg, -90.0, 90.0)?;
    check("longitude_deg", longitude_deg, -180.0, 180.0)?;
    Ok([latitude_deg, longitude_deg].map(|degrees| math::sin_cos(degrees.to_radians())))
}

fn check_distance(distance_m: f64) -> Result<(), GeodesyError> {
    check("distance_from_origin_m", distance_m, 0.0, FURTHEST_M)
}

fn check(name: &'static str, value: f64, min: f64, max: f64) -> Result<(), GeodesyError> {
    if (min..=max).contains(&value) { Ok(()) } else { Err(GeodesyError { name, value, min, max }) }
}

#[cfg(test)]
mod tests {
    use map_3d::{Ellipsoid::WGS84, geodetic2enu};

    use super::*;

    fn dms(degrees: f64, minutes: f64, seconds: f64) -> f64 {
        degrees + minutes / 60.0 + seconds / 3600.0
    }

    /// Flinders Peak to Buninyong, the example of the Geocentric Datum of Australia's technical manual: 54,972.271 m
    /// along the ellipsoid at an azimuth of 306° 52' 05.37". (The radius of its ellipsoid, GRS80, differs from WGS84 by
    /// 0.1 mm.)
    #[test]
    fn a_published_line_is_reproduced_in_the_plane() {
        let plane = LocalPlane::about(-dms(37.0, 57.0, 3.7203), dms(144.0, 25.0, 29.5244)).unwrap();
        let there = plane.position(-dms(37.0, 39.0, 10.1561), dms(143.0, 55.0, 35.3839)).unwrap();
        // Projected onto the plane, an arc s of radius R has the length R sin(s/R); R is 6,372 km in that direction.
        let (along_m, radius_m) = (54_972.271, 6.372e6);
        let expected_m = radius_m * math::sin(along_m / radius_m);
        let azimuth_deg = math::atan2(there.x_m(), there.y_m()).to_degrees() + 360.0;
        assert!((there.distance_m(Position::ORIGIN) - expected_m).abs() < 0.002, "{there:?}, {expected_m}");
        assert!((azimuth_deg - dms(306.0, 52.0, 5.37)).abs() < 0.1 / 3600.0, "{azimuth_deg}");
    }

    /// With WGS84's radii of curvature, a degree at 44.5 N is 111,122 m along the meridian and 79,530 m along the
    /// parallel.
    #[test]
    fn the_length_of_a_degree_matches_the_radii_of_curvature() {
        let plane = LocalPlane::about(44.5, 11.3).unwrap();
        let (north, east) = (plane.position(44.501, 11.3).unwrap(), plane.position(44.5, 11.301).unwrap());
        assert!((north.y_m() - 111.122).abs() < 0.001 && north.x_m().abs() < 1e-6, "{north:?}");
        assert!((east.x_m() - 79.530).abs() < 0.001 && east.y_m().abs() < 1e-3, "{east:?}");
        let across = LocalPlane::about(0.0, 179.9999).unwrap().position(0.0, -179.9999).unwrap();
        assert!((across.x_m() - 22.264).abs() < 0.001, "wrong across the date line: {across:?}");
    }

    /// The crate `map_3d` gives the same positions.
    #[test]
    fn positions_are_those_of_another_program() {
        for (latitude_deg, longitude_deg) in [(0.0, 0.0), (44.5, 11.3), (-37.95, 144.4), (89.0, -179.9), (-89.0, 180.0)]
        {
            let plane = LocalPlane::about(latitude_deg, longitude_deg).unwrap();
            for step in 0..40 {
                let (lat, lon) =
                    (latitude_deg + 0.01 * f64::from(step % 7 - 3), longitude_deg - 0.002 * f64::from(step));
                let lon = wrapped([lon, lat])[0];
                let [phi, lambda, phi_0, lambda_0] = [lat, lon, latitude_deg, longitude_deg].map(f64::to_radians);
                let (east_m, north_m, _) = geodetic2enu(phi, lambda, 0.0, phi_0, lambda_0, 0.0, WGS84);
                let position = plane.position(lat, lon).unwrap();
                assert!(position.distance_m(Position::from_m(east_m, north_m)) < 1e-7, "{lat}, {lon}: {position:?}");
            }
        }
    }

    #[test]
    fn the_conversions_are_inverse() {
        for (latitude_deg, longitude_deg) in [(0.0, 0.0), (44.5, 11.3), (-37.95, 144.4), (89.9, -179.9), (-90.0, 180.0)]
        {
            let plane = LocalPlane::about(latitude_deg, longitude_deg).unwrap();
            for (x_m, y_m, max_m) in [(0.0, 0.0, 1e-6), (3e3, -4e3, 1e-6), (-8e4, 6e4, 1e-6), (6e5, 7e5, 1e-6)] {
                let position = Position::from_m(x_m, y_m);
                let [lat, lon] = plane.degrees_at(position).unwrap();
                let back = plane.position(lat, lon).unwrap();
                let origin = format!("{latitude_deg}, {longitude_deg}");
                assert!(back.distance_m(position) < max_m, "{position:?} around {origin}: {back:?}");
            }
        }
    }

    #[test]
    fn invalid_or_distant_positions_are_rejected_with_the_allowed_range() {
        let plane = LocalPlane::about(0.0, 0.0).unwrap();
        let far = Position::from_m(8e5, 8e5);
        for (rejected, expected) in [
            (LocalPlane::about(90.1, 0.0).map(drop), "latitude_deg = 90.1: must be at least -90 and at most 90"),
            (LocalPlane::about(0.0, f64::NAN).map(drop), "longitude_deg = NaN: must be at least -180 and at most 180"),
            (plane.position(0.0, 180.5).map(drop), "longitude_deg = 180.5"),
            (
                plane.position(0.0, 180.0).map(drop),
                "distance_from_origin_m = 12756274: must be at least 0 and at most 1000000",
            ),
            (plane.degrees_at(far).map(drop), "distance_from_origin_m = 1131370.8"),
        ] {
            let error = rejected.unwrap_err().to_string();
            assert!(error.starts_with(expected), "{error}");
        }
        assert!(plane.position(0.0, 8.9).is_ok());
    }
}
