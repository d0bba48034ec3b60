//! Reads whole traffic files: those of the project, and real ones of `../shared/data` if available.

use standoff::math;
use std::path::{Path, PathBuf};
use std::time::Instant;

use standoff_sim::traffic::{Options, Traffic, VehicleState, read};

fn data() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    if !folder.is_dir() {
        println!("no ../shared/data here");
        return None;
    }
    Some(folder)
}

/// Returns the files whose names have this ending, sorted by name.
fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let paths = entries.map(|entry| entry.path());
    let mut files: Vec<PathBuf> = paths.filter(|path| path.to_string_lossy().ends_with(ending)).collect();
    files.sort();
    files
}

fn read_file(path: &Path) -> Traffic {
    read(path, &Options::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the states of both files at the times of the samples, every half second.
fn pairs(one: &Traffic, other: &Traffic) -> Vec<(VehicleState, VehicleState)> {
    let mut pairs = Vec::new();
    for (a, b) in one.vehicles.iter().zip(&other.vehicles) {
        assert_eq!((a.name(), a.first_us(), a.last_us()), (b.name(), b.first_us(), b.last_us()));
        for time_us in (a.first_us()..=a.last_us()).step_by(500_000) {
            assert_eq!(a.at(time_us).is_some(), b.at(time_us).is_some());
            pairs.extend(a.at(time_us).zip(b.at(time_us)));
        }
    }
    pairs
}

#[test]
fn every_file_is_read() {
    let Some(folder) = data() else { return };
    for path in [files(&folder, ".fcd.xml.gz"), files(&folder, ".csv.gz")].concat() {
        let start = Instant::now();
        let traffic = read_file(&path);
        let (begin_s, end_s) = (traffic.begin_us as f64 / 1e6, traffic.end_us as f64 / 1e6);
        println!(
            "{}: {} vehicles, {begin_s} to {end_s} s, read in {:.0} ms",
            path.file_name().unwrap().display(),
            traffic.vehicles.len(),
            start.elapsed().as_secs_f64() * 1e3
        );
        assert!(traffic.vehicles.len() >= 4 && end_s - begin_s >= 150.0);
        assert_eq!(traffic.origin.is_some(), path.to_string_lossy().contains(".geo."));
        for vehicle in &traffic.vehicles {
            let state = vehicle.at(vehicle.first_us()).unwrap();
            assert!(state.vx_m_s.abs() < 40.0 && state.vy_m_s.abs() < 40.0, "{}: {state:?}", vehicle.name());
        }
    }
}

#[test]
fn other_xml_is_refused() {
    let Some(folder) = data() else { return };
    for path in [files(&folder, ".net.xml.gz"), files(&folder, ".poly.xml.gz")].concat() {
        let error = read(&path, &Options::default()).unwrap_err().to_string();
        println!("{error}");
        assert!(error.contains("must be fcd-export"));
    }
}

/// UTM is rotated relative to true north by the grid convergence (1.63 degrees in Bologna, 0.59 in Hersfeld) and scaled
/// by up to 4e-4. In addition, the plane and the map differ in curvature. Therefore the files are aligned by the
/// rotation, scale and shift of the best fit; the remaining distance is at most 0.009 m.
#[test]
fn file_in_degrees_has_the_shape_of_the_file_in_metres() {
    let Some(folder) = data() else { return };
    for geo in files(&folder, ".geo.fcd.xml.gz") {
        let metres = PathBuf::from(geo.to_string_lossy().replace(".geo.", "."));
        let pairs = pairs(&read_file(&metres), &read_file(&geo));
        let count = pairs.len() as f64;
        let mean = |pick: fn(&(VehicleState, VehicleState)) -> f64| pairs.iter().map(pick).sum::<f64>() / count;
        let centre = (mean(|pair| pair.0.x_m), mean(|pair| pair.0.y_m));
        let geo_centre = (mean(|pair| pair.1.x_m), mean(|pair| pair.1.y_m));
        let centred: Vec<[f64; 4]> = pairs
            .iter()
            .map(|(a, b)| [a.x_m - centre.0, a.y_m - centre.1, b.x_m - geo_centre.0, b.y_m - geo_centre.1])
            .collect();
        let size = centred.iter().map(|[x, y, ..]| x * x + y * y).sum::<f64>();
        let along = centred.iter().map(|[x, y, u, v]| x * u + y * v).sum::<f64>() / size;
        let across = centred.iter().map(|[x, y, u, v]| x * v - y * u).sum::<f64>() / size;
        let worst = centred
            .iter()
            .map(|[x, y, u, v]| math::hypot(along * x - across * y - u, across * x + along * y - v))
            .fold(0.0, f64::max);
        let (turn_deg, scale) = (math::atan2(across, along).to_degrees(), math::hypot(along, across));
        println!(
            "{}: {count} pairs, turned by {turn_deg:.3} degrees, scaled by {scale:.5}, then within {worst:.3} m",
            geo.file_name().unwrap().display()
        );
        assert!(worst < 0.05 && turn_deg.abs() < 2.0 && (scale - 1.0).abs() < 1e-3);
    }
}

#[test]
fn gaps_of_measured_tracks_are_kept() {
    let Some(folder) = data() else { return };
    for path in files(&folder, ".csv.gz") {
        let traffic = read_file(&path);
        let absent = |vehicle: &standoff_sim::traffic::Vehicle| {
            let times = (vehicle.first_us()..vehicle.last_us()).step_by(100_000);
            times.filter(|&time_us| vehicle.at(time_us).is_none()).count()
        };
        let gaps: Vec<usize> = traffic.vehicles.iter().map(absent).collect();
        println!("{}: tenths of a second absent: {gaps:?}", path.file_name().unwrap().display());
        assert!(gaps.iter().any(|&tenths| tenths > 20) && gaps.contains(&0));
    }
}

#[test]
fn convoy_of_the_project_stays_together() {
    let traffic = read_file(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/traffic/convoy.fcd.xml.gz"));
    assert_eq!((traffic.vehicles.len(), traffic.begin_us, traffic.end_us), (6, 0, 219_500_000));
    for time_us in (0..=traffic.end_us).step_by(500_000) {
        let cars: Vec<VehicleState> = traffic.vehicles.iter().filter_map(|vehicle| vehicle.at(time_us)).collect();
        let all_six = (36_500_000..=165_500_000).contains(&time_us);
        assert_eq!(cars.len(), if all_six { 6 } else { 5 });
        let mean = |pick: fn(&VehicleState) -> f64| cars.iter().map(pick).sum::<f64>() / cars.len() as f64;
        let (x, y) = (mean(|car| car.x_m), mean(|car| car.y_m));
        assert!(cars.iter().all(|car| math::hypot(car.x_m - x, car.y_m - y) < 120.0), "at {time_us} us");
    }
}
