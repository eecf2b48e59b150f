use omni_sim::{config::*, *};
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let n: usize = args[0].parse().unwrap();
    let sets: Vec<_> = args[1..].iter().map(|a| Override::parse(a).unwrap()).collect();
    for p in ["independent", "paper", "synchronised", "load_sharing"] {
        let mut c = 0;
        let mut txt = String::new();
        let (mut sp, mut he, mut ts) = (0.0, 0.0, 0.0);
        for k in 0..n {
            let mut sets = sets.clone();
            sets.push(Override::new("seed", k as i64));
            sets.push(Override::new("perturbation.yaw_rad", 0.03));
            sets.push(Override::new("perturbation.start_m", 0.02));
            let s = Scenario::load("step", &sets).unwrap().with_policy(p).unwrap();
            let o = Outcome::of(&s, &run(&s).unwrap());
            if o.climbed {
                c += 1;
                txt += &format!(" {:.2}", o.crossing_s.unwrap());
                ts += o.crossing_s.unwrap();
            } else {
                txt += " -";
            }
            sp += o.spread_rms / n as f64;
            he += o.heat_n2m2s / n as f64;
        }
        println!(
            "{p} {c}/{n} spread {sp:.3} heat {he:.1} t {:.2} {txt}",
            ts / c as f64
        );
    }
}
