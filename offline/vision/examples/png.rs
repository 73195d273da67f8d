//! To PNG, with a crop and a scale.
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let mut im = image::open(&a[1]).unwrap().to_rgb8();
    if a.len() > 6 {
        let n: Vec<u32> = a[3..7].iter().map(|s| s.parse().unwrap()).collect();
        im = image::imageops::crop(&mut im, n[0], n[1], n[2], n[3]).to_image();
        let s: u32 = a.get(7).map_or(1, |s| s.parse().unwrap());
        im = image::imageops::resize(&im, n[2] * s, n[3] * s, image::imageops::FilterType::Nearest);
    }
    im.save(&a[2]).unwrap();
}
