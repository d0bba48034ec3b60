//! Columns with the time and place of a row on the Earth. They are for other programs: readers in this crate skip them.

use std::path::Path;

use standoff::Position;
use standoff_io::geodesy::LocalPlane;

use crate::column::{self, Column, Columns, Declaration, Field as _, Row};
use crate::error::RecordError;
use crate::manifest::{MANIFEST, Manifest};
use crate::schema::{At, UtcTime};

/// Time and place of a mission on the Earth, as far as they are known.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Earth {
    plane: Option<LocalPlane>,
    /// Start of the mission in UTC, microseconds since 1970.
    pub(crate) begin_unix_us: Option<i64>,
}

/// Columns `x_m` and `y_m` of a table.
pub(crate) type PositionColumns<R> = Option<[Box<dyn Column<At<R>>>; 2]>;

impl Earth {
    pub(crate) fn of(manifest: &Manifest) -> Result<Self, RecordError> {
        let plane = manifest.origin.map(|origin| origin.plane()).transpose();
        let plane = plane.map_err(|error| RecordError::damaged(Path::new(MANIFEST), error.to_string()))?;
        Ok(Self { plane, begin_unix_us: manifest.begin_unix_us })
    }

    /// Returns the columns of a table, and those with the positions to convert to degrees.
    pub(crate) fn columns<R: Row>(&self) -> (Columns<At<R>>, PositionColumns<R>) {
        let mut columns = column::columns::<At<R>>();
        if self.begin_unix_us.is_some() {
            UtcTime::declare(Declaration::new("time_utc", ""), &mut columns, |row| &mut row.time_utc);
        }
        let mut position = column::columns::<At<R>>();
        position.retain(|column| self.plane.is_some() && ["x_m", "y_m"].contains(&&*column.declaration().name));
        let position = position.try_into().ok();
        if position.is_some() {
            Option::declare(Declaration::new("latitude_deg", ""), &mut columns, |row| &mut row.latitude_deg);
            Option::declare(Declaration::new("longitude_deg", ""), &mut columns, |row| &mut row.longitude_deg);
        }
        (columns, position)
    }

    /// Sets the time and place of a row.
    pub(crate) fn locate<R>(&self, row: &mut At<R>, position: &PositionColumns<R>) {
        row.time_utc = UtcTime(self.begin_unix_us.unwrap_or_default().saturating_add(row.time_us));
        let Some((plane, [x_m, y_m])) = self.plane.zip(position.as_ref()) else { return };
        let position = x_m.number(row).zip(y_m.number(row)).map(|(x_m, y_m)| Position::from_m(x_m, y_m));
        // A third-party controller may report a track further away than the plane is a map of the Earth.
        let degrees = position.and_then(|position| plane.degrees_at(position).ok());
        (row.latitude_deg, row.longitude_deg) = degrees.map(<[f64; 2]>::into).unzip();
    }
}
