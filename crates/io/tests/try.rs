use std::path::Path;
#[test]
fn t() {
    let p = std::env::var("SCENE").unwrap();
    let spp: u64 = std::env::var("SPP").unwrap().parse().unwrap();
    let loaded = io::load_scene(Path::new(&p), &Default::default());
    let loaded = match loaded { Ok(l) => l, Err(d) => { println!("{d}"); panic!() } };
    println!("{}", loaded.warnings);
    let t = std::time::Instant::now();
    let r = transport::render::render(&loaded.groups, &transport::render::Options{samples: spp, seed: 11}, |_| std::ops::ControlFlow::Continue(()));
    println!("{:?} {:?} {:?}", t.elapsed(), r.film.summary(), r.stats);
    let img = r.film.mean();
    let b: Vec<u8> = img.iter().flat_map(|v| v.to_le_bytes()).collect();
    std::fs::write("/tmp/o.f32", b).unwrap();
    let img = r.film.variance();
    let b: Vec<u8> = img.iter().flat_map(|v| v.to_le_bytes()).collect();
    std::fs::write("/tmp/o.var", b).unwrap();
}
