//! Episodes for reinforcement learning, without any learning: full speed ahead, whatever is seen.
//!
//! Prints what was drawn for each episode, how it ended and what it was worth. The vehicle does not
//! know how high and how slippery the step is.
#![expect(clippy::print_stdout, reason = "an example speaks on standard output")]

use omni_sim::learn::{Episode, Task};
use omni_sim::{Error, config::Scenario};

fn main() -> Result<(), Error> {
    // An action is held for 20 control periods, 20 ms.
    let mut episode = Episode::new(Task::StepClimb, &Scenario::load("step", &[])?, &[], 20)?;
    let mut action = vec![0.0; episode.actions()];
    action[0] = 1.0; // the forward command; a policy would make all of them from `observation`
    println!("episode  height [cm]  friction  success  time [s]  return");
    let mut successes = 0.0;
    for seed in 0..5 {
        episode.reset(Some(seed), &[])?;
        let mut worth = 0.0;
        let info = loop {
            let turn = episode.step(&action)?;
            worth += turn.reward;
            if turn.terminated || turn.truncated {
                break turn.info;
            }
        };
        let [success, time_s, _, _, height_m, friction, _] = info[..] else {
            unreachable!("Episode::info_names() are seven");
        };
        let height_cm = 1e2 * height_m;
        println!("{seed:7}{height_cm:13.1}{friction:10.2}{success:9}{time_s:10.2}{worth:8.2}");
        successes += success;
        // Climbing is worth 2, a metre forward 1: who got over the step is beyond it by a vehicle's length.
        assert!((success == 1.0) == (worth > 2.0));
    }
    println!("{successes} of 5");
    assert!(successes >= 2.0);
    Ok(())
}
