//! Meters in scene files, and their readings as files.

use glam::{DMat3, DVec3};
use morgana_io::arrays::{Array, ArrayFormat, Arrays, Context, arrays};
use morgana_io::element::Element;
use morgana_io::volume::{Options, Volume};
use morgana_io::{Limits, LoadOptions, Loaded, npy};
use std::fs;
use std::io::Read;
use std::ops::ControlFlow;
use std::path::Path;
use transport::meter::{Coordinates, Estimator, Meter};
use transport::render::{Handle, MeasureOptions, Measurement, measure};

/// An absorbing ball of radius 1 in a beam of power 2, with given contents of the ball and the
/// scene.
fn scene(inside: &str, body: &str) -> String {
    format!(
        r#"<scene version="3.0.0">
<integrator type="particle"/>
<shape type="sphere"><bsdf type="null"/>
  <medium type="homogeneous" name="interior"><float name="sigma_t" value="2"/><float name="albedo" value="0.5"/></medium>
  {inside}
</shape>
<emitter type="collimated">
  <transform name="to_world"><translate z="-2"/></transform>
  <float name="radius" value="0.5"/><float name="power" value="2"/>
</emitter>
{body}
</scene>"#
    )
}

const BOX: &str = r#"<transform name="to_world"><translate value="-0.5"/><scale value="2"/></transform>
<integer name="nx" value="2"/><integer name="ny" value="3"/><integer name="nz" value="4"/>"#;

fn fluence(more: &str) -> String {
    format!("<sensor type=\"fluencemeter\" id=\"tank\">{BOX}{more}</sensor>")
}

fn load(text: &str) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

#[track_caller]
fn refused(inside: &str, body: &str, expected: &str) {
    let message = load(&scene(inside, body)).expect_err("the scene was accepted");
    assert!(
        message.contains(expected),
        "expected {expected:?} in:\n{message}"
    );
}

#[track_caller]
fn warned(text: &str, expected: &str) {
    let warnings = load(text).unwrap().warnings.to_string();
    assert!(
        warnings.contains(expected),
        "expected {expected:?} in:\n{warnings}"
    );
}

fn run(loaded: &Loaded, particles: u64) -> Measurement {
    let meters: Vec<Meter> = loaded.instruments.iter().map(|i| i.meter.clone()).collect();
    let options = MeasureOptions {
        first: 0,
        particles,
        seed: 1,
        max_depth: None,
        rr_depth: 5,
    };
    let go_on = |_| ControlFlow::Continue(());
    measure(&loaded.groups, &meters, &options, &Handle::default(), go_on).unwrap()
}

fn readings(loaded: &Loaded, measurement: &Measurement) -> Arrays {
    let context = Context {
        instruments: &loaded.instruments,
        measurement,
        channels: &loaded.channel_names,
        meter: None,
    };
    let balance = serde_json::json!({"escaped": {"mean": 0.5}});
    arrays(
        &context,
        vec![("seed".into(), 1.into()), ("balance".into(), balance)],
    )
}

fn array<'a>(arrays: &'a Arrays, name: &str) -> &'a Array {
    let found = arrays.list.iter().find(|a| a.name == name);
    found.unwrap_or_else(|| panic!("no {name}"))
}

#[test]
fn meters_take_the_place_of_a_camera() {
    let sampler = r#"<string name="estimator" value="collision"/><string name="coordinates" value="cartesian"/>
        <sampler type="independent"><integer name="sample_count" value="1234"/></sampler>"#;
    let inside = r#"<sensor type="irradiancemeter" id="skin"><integer name="nv" value="5"/>
        <integer name="cosine_bins" value="7"/><float name="max_bound" value="4"/><float name="bin_width" value="0.5"/></sensor>"#;
    let loaded = load(&scene(inside, &fluence(sampler))).unwrap();
    // The meter of the ball requests the default of a million.
    assert_eq!(loaded.samples, 1_000_000);
    assert_eq!(loaded.channel_names, ["Y"]);
    let names: Vec<&str> = loaded.instruments.iter().map(|i| i.name.as_str()).collect();
    assert_eq!(names, ["tank", "skin"]);
    let Meter::Fluence(tank) = &loaded.instruments[0].meter else {
        panic!("{:?}", loaded.instruments[0]);
    };
    assert_eq!(tank.grid.size(), [2, 3, 4]);
    assert_eq!(tank.grid.coordinates(), Coordinates::Cartesian);
    assert_eq!(tank.estimator, Estimator::Collision);
    let Meter::Irradiance(skin) = &loaded.instruments[1].meter else {
        panic!("{:?}", loaded.instruments[1]);
    };
    assert_eq!((skin.surfaces[0].object, skin.positions.bins()), (0, 5));
    assert_eq!(skin.cosines.unwrap().count, 7);
    assert_eq!(skin.optical_length.unwrap().count, 8);
    let only = load(&scene("", &fluence(sampler))).unwrap();
    assert_eq!(only.samples, 1234);
}

#[test]
fn mistakes_are_named() {
    let meter = |more: &str| {
        format!("<sensor type=\"fluencemeter\"><integer name=\"nr\" value=\"3\"/>{more}</sensor>")
    };
    let word = |name: &str, value: &str| format!("<string name=\"{name}\" value=\"{value}\"/>");
    let number = |name: &str, value: &str| format!("<float name=\"{name}\" value=\"{value}\"/>");
    refused(
        "",
        "<sensor type=\"fluencemeter\"/>",
        "needs <integer name=\"nx\">",
    );
    refused("", &meter(&word("coordinates", "polar")), "polar");
    let shells = word("coordinates", "spherical");
    assert!(load(&scene("", &meter(&shells))).is_ok());
    let with = |more: &str| meter(&format!("{shells}{more}"));
    refused("", &with(&number("nz", "2")), "nz");
    refused("", &with(&number("estimater", "2")), "estimater");
    refused("", &with(&number("bin_width", "0.5")), "max_bound");
    let bins =
        |max: &str, width: &str| with(&(number("max_bound", max) + &number("bin_width", width)));
    refused("", &bins("1", "0.3"), "do not fill the range");
    refused(
        "",
        &with(&(number("min_bound", "2") + &number("max_bound", "1") + &number("bin_width", "1"))),
        "greater than 'min_bound'",
    );
    refused("", &with(&number("pulse_energy", "1")), "pulse_energy");
    refused("", &with(&number("gruneisen", "-1")), "gruneisen");
    refused(
        "",
        &with("<transform name=\"to_world\"><matrix value=\"1 0 0 0 0 0 0 0 0\"/></transform>"),
        "cannot be inverted",
    );
    refused(
        "",
        &with("<film type=\"hdrfilm\"><integer name=\"width\" value=\"8\"/></film>"),
        "width",
    );
    refused("", "<sensor type=\"irradiancemeter\"/>", "inside its shape");
    refused("<sensor type=\"fluencemeter\"/>", "", "not in a shape");
    refused("<sensor type=\"perspective\"/>", "", "irradiancemeter");
    refused(
        "<sensor type=\"irradiancemeter\"><vector name=\"cosine_axis\" z=\"1\"/></sensor>",
        "",
        "cosine_bins",
    );
    let camera = "<sensor type=\"perspective\"><float name=\"fov\" value=\"40\"/></sensor>";
    refused(
        "",
        &(with("") + camera),
        "a scene is either rendered or measured",
    );
}

#[test]
fn frequencies_of_modulated_light_are_checked() {
    let with = |hertz: &str, metres: &str| {
        let frequencies =
            format!("<string name=\"modulation_frequencies\" value=\"{hertz}\"/>{metres}");
        fluence(&frequencies)
    };
    let metres = r#"<float name="metres_per_unit" value="1e-3"/>"#;
    refused("", &with("100e6", ""), "needs 'metres_per_unit'");
    let inside = r#"<sensor type="irradiancemeter"><string name="modulation_frequencies" value="1e8"/></sensor>"#;
    refused(inside, "", "needs 'metres_per_unit'");
    for hertz in [
        "",
        "-1e8",
        "0",
        "2e8, 1e8",
        "1e8, 1e8",
        &["1e8"; 65].join(" "),
    ] {
        refused("", &with(hertz, metres), "1 to 64 frequencies in Hz");
    }
    refused("", &with("100 MHz", metres), "is a list of numbers");
    let metres_of_zero = r#"<float name="metres_per_unit" value="0"/>"#;
    refused("", &with("1e8", metres_of_zero), "metres_per_unit");
    warned(&scene("", &with("100", metres)), "write 100e6 for 100 MHz");
    // The ball has no index of its own.
    warned(
        &scene("", &with("1e8", metres)),
        "phases of modulated light are those of vacuum",
    );
}

/// A phase has its own unit and no normalisation. Amplitude and phase are those of their parts.
#[test]
fn modulated_light_has_amplitude_and_phase() {
    let more = r#"<string name="modulation_frequencies" value="1e8 2e8"/><float name="metres_per_unit" value="0.1"/>"#;
    let loaded = load(&scene("", &fluence(more))).unwrap();
    let measurement = run(&loaded, 500);
    let arrays = readings(&loaded, &measurement);
    assert_eq!(array(&arrays, "modulation_frequencies").data, [1e8, 2e8]);
    let parts = ["in_phase", "quadrature", "amplitude", "phase"]
        .map(|part| array(&arrays, &format!("fluence_{part}")));
    let units = parts.map(|part| part.unit.as_str());
    assert_eq!(units, ["W/unit^2", "W/unit^2", "W/unit^2", "rad"]);
    for part in parts {
        assert_eq!(part.shape, [2, 4, 3, 2]);
        assert_eq!(part.axes.join(" "), "frequency z y x");
    }
    let [in_phase, quadrature, amplitude, phase] = parts.map(|part| &part.data);
    for i in 0..amplitude.len() {
        let (x, y) = (in_phase[i], quadrature[i]);
        assert!((amplitude[i] - x.hypot(y)).abs() < 1e-12);
        assert!((phase[i] - y.atan2(x)).abs() < 1e-12);
    }
    assert!(arrays.list.iter().all(|a| a.name != "frequency_edges"));
}

/// A sampler that does not mention the sound adopts the settings of the others.
#[test]
fn samplers_of_meters_agree_on_the_sound() {
    let sampler = |sound: &str| format!("<sampler type='independent'>{sound}</sampler>");
    let straight = sampler("<boolean name='bending' value='false'/>");
    let pair = |a: &str, b: &str| [fluence(a), fluence(b).replace("tank", "vat")].concat();
    let disagrees = "their samplers must agree on 'bending' and 'phases'";
    refused("", &pair(&straight, &sampler("")), disagrees);
    let phases = |n| sampler(&format!("<integer name='phases' value='{n}'/>"));
    refused("", &pair(&phases(4), &phases(2)), disagrees);
    for (a, b) in [
        (&straight, &straight),
        (&straight, &String::new()),
        (&phases(1), &sampler("")),
    ] {
        load(&scene("", &pair(a, b))).unwrap();
    }
}

#[test]
fn doubts_are_told() {
    let far = fluence("").replace("-0.5", "30");
    warned(&scene("", &far), "no medium attenuates");
    let partly = fluence("<string name=\"estimator\" value=\"collision\"/>")
        .replace("\"2\"/></transform>", "\"3\"/></transform>");
    warned(&scene("", &partly), "track_length");
    warned(
        &scene("", &fluence("")).replace("\"particle\"", "\"path\""),
        "particle",
    );
    let fine = load(&scene("", &fluence(""))).unwrap();
    assert!(fine.warnings.is_empty(), "{}", fine.warnings);
}

/// Grids of meters belong to the extent that the sky lights.
#[test]
fn the_sky_fills_grids_beyond_the_scene() {
    let speck = "<transform name='to_world'><scale value='0.01'/></transform><bsdf type='null'/>";
    let text = format!(
        r#"<scene version="3.0.0"><shape type="sphere">{speck}</shape><emitter type="constant"/>{}</scene>"#,
        fluence("")
    );
    let loaded = load(&text).unwrap();
    let arrays = readings(&loaded, &run(&loaded, 20_000));
    let [mean, error] = ["fluence", "fluence_error"].map(|name| array(&arrays, name));
    for (mean, error) in mean.data.iter().zip(&error.data) {
        assert!(
            (mean - 4.0 * std::f64::consts::PI).abs() < 4.5 * error,
            "{mean} ± {error}"
        );
    }
}

#[test]
fn readings_have_units_axes_and_normalizations() {
    let more = r#"<float name="gruneisen" value="0.25"/><float name="pulse_energy" value="0.5"/>
        <float name="metres_per_unit" value="0.01"/><string name="normalization" value="per_watt"/>"#;
    let absolute = load(&scene("", &fluence(""))).unwrap();
    let per_watt = load(&scene("", &fluence(more))).unwrap();
    let measurement = run(&absolute, 500);
    let (a, b) = (
        readings(&absolute, &measurement),
        readings(&per_watt, &measurement),
    );
    let (power, share) = (array(&a, "absorbed"), array(&b, "absorbed"));
    assert_eq!(
        (power.shape.as_slice(), power.axes.join(" ").as_str()),
        (&[4, 3, 2][..], "z y x")
    );
    assert_eq!(
        (power.unit.as_str(), share.unit.as_str()),
        ("W/unit^3", "1/unit^3")
    );
    assert_eq!(array(&a, "emitted").data, [2.0]);
    assert_eq!(array(&a, "z_edges").data, [-1.0, -0.5, 0.0, 0.5, 1.0]);
    assert_eq!(&array(&a, "to_world").data[..4], [2.0, 0.0, 0.0, -1.0]);
    let pressure = array(&b, "p0");
    assert_eq!(pressure.unit, "Pa");
    for ((power, share), pressure) in power.data.iter().zip(&share.data).zip(&pressure.data) {
        assert!((share * 2.0 - power).abs() < 1e-12);
        // Γ μ_a Φ of 0.5 J in cubic metres.
        assert!((pressure - 0.25 * 0.5 * share * 1e6).abs() <= 1e-9 * pressure.abs());
    }
    let attribute = |name: &str| {
        let found = b.attributes.iter().find(|(n, _)| n == name);
        found.and_then(|(_, value)| value.as_str())
    };
    assert_eq!(attribute("normalization"), Some("per_watt"));
    assert_eq!(attribute("meter"), Some("tank"));
    // The absorbed fraction of the box, which the ball touches, is the ball's.
    let volume = 8.0 / 24.0;
    let absorbed: f64 = power.data.iter().sum::<f64>() * volume;
    assert!((absorbed / measurement.balance.media.mean - 1.0).abs() < 0.1);
}

#[test]
fn films_of_further_meters_are_ignored_with_a_warning() {
    let film = |format: &str| {
        let format = format!("<string name=\"pixel_format\" value=\"{format}\"/>");
        format!("<film type=\"hdrfilm\">{format}</film>")
    };
    let two = |first: &str, second: &str| {
        let second = fluence(second).replace("tank", "other");
        scene("", &(fluence(first) + &second))
    };
    let at_wall = format!("<sensor type=\"irradiancemeter\">{}</sensor>", film("rgb"));
    for (text, shared) in [
        (two("", &film("rgb")), "Y"),
        (two(&film("rgb"), &film("luminance")), "R, G, B"),
        (scene(&at_wall, &fluence("")), "Y"),
    ] {
        let expected = format!("meters use the channels {shared} of the first meter");
        warned(&text, &expected);
    }
    for text in [
        two(&film("rgb"), &film("rgb")),
        two(&film("rgb"), ""),
        scene(&at_wall, ""),
    ] {
        let warnings = load(&text).unwrap().warnings.to_string();
        assert!(!warnings.contains("film"), "{warnings}");
    }
}

#[test]
fn weight_windows_without_bins_of_length_draw_a_warning() {
    let windows = r#"<boolean name="weight_windows" value="true"/>"#;
    let bins = r#"<float name="max_bound" value="4"/><float name="bin_width" value="1"/>"#;
    let text = |more: &str| scene("", &fluence(more));
    let expected = "'weight_windows' has no effect without bins of optical path length";
    warned(&text(windows), expected);
    let loaded = load(&text(&format!("{windows}{bins}"))).unwrap();
    assert!(!loaded.warnings.to_string().contains("weight_windows"));
}

#[test]
fn channels_run_last() {
    let film = r#"<film type="hdrfilm"><string name="pixel_format" value="spectral"/>
        <string name="wavelengths" value="400, 500, 600, 700, 800"/></film>"#;
    let tinted = scene("", &fluence(film)).replace(
        "<float name=\"power\" value=\"2\"/>",
        "<spectrum name=\"power\" value=\"400:1, 800:5\"/>",
    );
    let loaded = load(&tinted).unwrap();
    assert_eq!(loaded.groups.len(), 2);
    let measurement = run(&loaded, 300);
    assert_eq!(measurement.emitted, [1.0, 2.0, 3.0, 4.0, 5.0]);
    let arrays = readings(&loaded, &measurement);
    let fluence = array(&arrays, "fluence");
    assert_eq!(fluence.shape, [4, 3, 2, 5]);
    let middle = &fluence.data[5 * (2 + 2 * 3)..][..5];
    // The first four channels share their paths; the medium is grey.
    assert!((middle[1] / middle[0] - 2.0).abs() < 1e-9, "{middle:?}");
    assert!(middle[4] > 3.0 * middle[0], "{middle:?}");
}

/// Writes in a format and returns the bytes.
fn written(arrays: &Arrays, folder: &Path, name: &str, format: ArrayFormat) -> Vec<u8> {
    let path = folder.join(name);
    arrays.write(&path, format, Element::F64).unwrap();
    fs::read(path).unwrap()
}

#[test]
fn files_give_back_what_was_written() {
    let loaded = load(&scene("", &fluence(""))).unwrap();
    let arrays = readings(&loaded, &run(&loaded, 500));
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let fluence = array(&arrays, "fluence");
    let [effective, few] = ["fluence_effective", "fluence_few"].map(|name| array(&arrays, name));
    assert_eq!([&effective.shape, &few.shape], [&fluence.shape; 2]);
    for (effective, few) in effective.data.iter().zip(&few.data) {
        assert!(*few == 1.0 || *few == 0.0 && *effective >= 10.0);
    }

    written(&arrays, folder, "a.npy", ArrayFormat::Npy);
    let npy = npy::read(&folder.join("a.npy")).unwrap();
    assert_eq!(npy.shape, fluence.shape);
    assert_eq!(npy.data, npy::NpyData::F64(fluence.data.clone()));

    let bytes = written(&arrays, folder, "a.npz", ArrayFormat::Npz);
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(bytes)).unwrap();
    for array in &arrays.list {
        let mut entry = Vec::new();
        let name = format!("{}.npy", array.name);
        archive
            .by_name(&name)
            .unwrap()
            .read_to_end(&mut entry)
            .unwrap();
        let found = npy::parse(&entry).unwrap();
        assert_eq!(found.shape, array.shape);
        assert_eq!(found.data, npy::NpyData::F64(array.data.clone()));
    }
    let mut metadata = Vec::new();
    archive
        .by_name("metadata.npy")
        .unwrap()
        .read_to_end(&mut metadata)
        .unwrap();
    let start = metadata.iter().position(|b| *b == b'\n').unwrap() + 1;
    let letters = metadata[start..].chunks(4).map(|c| char::from(c[0]));
    let metadata: serde_json::Value = serde_json::from_str(&letters.collect::<String>()).unwrap();
    assert_eq!(metadata["seed"], 1);
    assert_eq!(metadata["balance"]["escaped"]["mean"], 0.5);
    assert_eq!(metadata["arrays"]["fluence"]["unit"], "W/unit^2");
    assert!(metadata["few"].as_str().unwrap().contains(", absorbed "));

    let bytes = written(&arrays, folder, "a.h5", ArrayFormat::Hdf5);
    let file = hdf5_reader::Hdf5File::from_bytes(&bytes).unwrap();
    for array in &arrays.list {
        let dataset = file.dataset(&format!("/{}", array.name)).unwrap();
        let found = dataset.read_array::<f64>().unwrap();
        assert_eq!(found.shape(), array.shape);
        assert_eq!(found.as_slice().unwrap(), array.data);
        let axes = dataset.attribute("axes").unwrap().read_string().unwrap();
        assert_eq!(axes, array.axes.join(" "));
    }

    let bytes = written(&arrays, folder, "a.nrrd", ArrayFormat::Nrrd);
    let end = bytes.windows(2).position(|w| w == b"\n\n").unwrap();
    let header = str::from_utf8(&bytes[..end]).unwrap();
    for line in [
        "NRRD0005",
        "type: double",
        "sizes: 2 3 4",
        "space origin: (-0.5,-0.6666666666666667,-0.75)",
        "labels: \"x\" \"y\" \"z\"",
        "seed:=1",
        "few:=fluence ",
    ] {
        assert!(header.contains(line), "{line} in {header}");
    }
    let values = bytes[end + 2..]
        .chunks(8)
        .map(|c| f64::from_le_bytes(c.try_into().unwrap()));
    assert_eq!(values.collect::<Vec<_>>(), fluence.data);

    // Read it back by the project's own readers.
    let read = |name| Arrays::read(&folder.join(name), Limits::default()).unwrap();
    let sorted = |mut list: Vec<Array>| {
        list.sort_by(|a, b| a.name.cmp(&b.name));
        list
    };
    for name in ["a.npz", "a.h5"] {
        let back = read(name);
        assert_eq!(sorted(back.list), sorted(arrays.list.clone()), "{name}");
        let seed = back.attributes.iter().find(|(name, _)| name == "seed");
        let seed = seed.unwrap().1.clone();
        assert!(seed == 1 || seed == "1", "{seed}");
        let balance = back.attributes.iter().find(|(name, _)| name == "balance");
        assert_eq!(balance.unwrap().1["escaped"]["mean"], 0.5, "{name}");
        assert!(Arrays::read_measurement(&folder.join(name), Limits::default()).is_ok());
    }
    let error = Arrays::read_measurement(&folder.join("a.nrrd"), Limits::default()).unwrap_err();
    assert!(error.to_string().contains("not a readings file"), "{error}");
    let volume = array(&read("a.nrrd"), "volume").clone();
    assert_eq!(
        (&volume.shape, &volume.data, &volume.axes),
        (&fluence.shape, &fluence.data, &fluence.axes)
    );
}

#[test]
fn arrays_of_others_have_axes_with_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.h5");
    let values: Vec<f32> = (0..6).map(|i| i as f32).collect();
    let dataset = hdf5_writer::DatasetBuilder::typed_data("p", vec![2, 3], &values).unwrap();
    let plan = hdf5_writer::Hdf5Builder::new().dataset(dataset).into_plan();
    let file = fs::File::create(&path).unwrap();
    let writer = hdf5_writer::Hdf5Writer::new(file, hdf5_writer::WriteOptions::default());
    writer.finish(plan.unwrap()).unwrap();
    let read = Arrays::read(&path, Limits::default()).unwrap();
    let found = array(&read, "p");
    assert_eq!(found.data, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
    assert_eq!((&found.shape[..], found.unit.as_str()), (&[2, 3][..], ""));
    assert_eq!(found.axes, ["axis 0", "axis 1"]);

    // NRRD lists its fastest axis first.
    let path = folder.path().join("a.nrrd");
    let header = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 3 2 1\nencoding: raw\n\n";
    fs::write(&path, [header.as_bytes(), &[0, 1, 2, 3, 4, 5]].concat()).unwrap();
    let read = Arrays::read(&path, Limits::default()).unwrap();
    let found = array(&read, "volume");
    assert_eq!(found.shape, [1, 2, 3]);
    assert_eq!(found.data, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
}

#[test]
fn several_meters_need_a_file_of_several_arrays() {
    let inside = "<sensor type=\"irradiancemeter\"/>";
    let loaded = load(&scene(inside, &fluence(""))).unwrap();
    let arrays = readings(&loaded, &run(&loaded, 100));
    assert_eq!(array(&arrays, "irradiancemeter.power").shape, [2]);
    assert_eq!(array(&arrays, "tank.fluence").shape, [4, 3, 2]);
    let folder = tempfile::tempdir().unwrap();
    let error = arrays
        .write(&folder.path().join("a.npy"), ArrayFormat::Npy, Element::F64)
        .unwrap_err();
    assert!(error.to_string().contains("several meters"), "{error}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// Grids in space as this project's own readers see them. python/tests/test_reading_files.py has
/// other libraries read all formats.
#[test]
fn files_of_grids_keep_place_and_errors() {
    let loaded = load(&scene(
        "",
        &fluence(r#"<float name="metres_per_unit" value="1e-3"/>"#),
    ));
    let loaded = loaded.unwrap();
    let arrays = readings(&loaded, &run(&loaded, 500));
    let [mean, error] = ["fluence", "fluence_error"].map(|name| array(&arrays, name));
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // The box is [-1, 1]³, with 2 × 3 × 4 cells.
    let first = DVec3::new(-0.5, -2.0 / 3.0, -0.75);
    let steps = DVec3::new(1.0, 2.0 / 3.0, 0.5);
    for (name, format) in [
        ("a.vti", ArrayFormat::Vti),
        ("a.nii", ArrayFormat::Nifti),
        ("a.nii.gz", ArrayFormat::Nifti),
        ("a.jnii", ArrayFormat::Jnifti),
        ("a.bnii", ArrayFormat::Jnifti),
        ("a.nrrd", ArrayFormat::Nrrd),
    ] {
        for element in [Element::F32, Element::F64] {
            let path = folder.join(name);
            arrays.write(&path, format, element).unwrap();
            let second = format.errors_beside(&path);
            let place = second.as_ref().unwrap_or(&path);
            for (array, path) in [(mean, &path), (error, place)] {
                let several = Options::default().of(&array.name);
                let options = if format == ArrayFormat::Vti {
                    several
                } else {
                    Options::default()
                };
                let volume = Volume::<f64>::read(path, options).unwrap();
                let rounded: Vec<f64> = array.data.iter().map(|v| element.nearest(*v)).collect();
                assert_eq!(
                    (volume.size(), volume.element()),
                    ([2, 3, 4], element),
                    "{name}"
                );
                assert_eq!(volume.data(), rounded, "{name}");
                let frame = volume.place();
                assert!((frame.first - first).abs().max_element() < 1e-6, "{name}");
                let found = frame.steps - DMat3::from_diagonal(steps);
                assert!(
                    found.to_cols_array().iter().all(|v| v.abs() < 1e-6),
                    "{name}"
                );
                let unit = (format != ArrayFormat::Vti).then_some("mm");
                assert_eq!(volume.unit(), unit, "{name}");
            }
        }
    }
    let beside = ArrayFormat::Nifti.errors_beside(Path::new("b/a.NII.GZ"));
    assert_eq!(beside.unwrap(), Path::new("b/a_error.NII.GZ"));
}

#[test]
fn matlab_files_keep_all_arrays() {
    let loaded = load(&scene("", &fluence(""))).unwrap();
    let arrays = readings(&loaded, &run(&loaded, 100));
    let folder = tempfile::tempdir().unwrap();
    written(&arrays, folder.path(), "a.mat", ArrayFormat::Mat);
    let back = Arrays::read(&folder.path().join("a.mat"), Limits::default()).unwrap();
    assert_eq!(back.list.len(), arrays.list.len());
    let found = array(&back, "fluence");
    assert_eq!(found.shape, [2, 3, 4]);
    let mean = array(&arrays, "fluence");
    for (i, value) in found.data.iter().enumerate() {
        let (x, y, z) = (i / 12, i / 4 % 3, i % 4);
        assert_eq!(*value, mean.data[2 * (3 * z + y) + x]);
    }
    assert_eq!(
        array(&back, "to_world").data,
        array(&arrays, "to_world").data
    );
}
