#![allow(dead_code, unused, missing_docs)]
mod a { include!("/tmp/d_keep/body.rs");
pub fn main(){ let a:Vec<u64>=std::env::args().skip(1).map(|x|x.parse().unwrap()).collect(); let s=a[0]..a[1];
 for g in &GROUNDS { judged::<f64,7>(g,"chugo7",s.clone()); judged::<f64,4>(g,"mecanum4",s.clone()); judged::<f64,6>(g,"rocker_bogie6",s.clone()); if ["flat","ice"].contains(&g.name){ let j=judged::<f64,3>(g,"omni3",s.clone()); println!("omni3 place {:.4} odo {:.4}",j.place_m,j.odometry_m);} } } }
fn main(){a::main()}
