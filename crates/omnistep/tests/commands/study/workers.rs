//! Workers that have the same batch, and readers who look while others write.

use std::num::NonZeroUsize;
use std::sync::atomic::Ordering;

use omni_study::Batch;

use super::points::growing;
use super::*;

const ONE: Option<NonZeroUsize> = NonZeroUsize::new(1);

/// A folder that is held, and all 24 runs as one batch.
fn one_batch() -> (tempfile::TempDir, Store, fs::File, Batch) {
    let plan = plan_of(SMALL);
    let folder = tempfile::tempdir().unwrap();
    let store = Store::new(folder.path(), &plan).unwrap();
    let lock = store.lock().unwrap();
    let batch = Batch::new(&plan, plan.runs()).unwrap();
    (folder, store, lock, batch)
}

/// A worker that is asked to stop after so many rows, and what happens before it gets to that; how
/// many rows it computed.
fn ended_after(batch: &Batch, folder: &Path, most: usize, meanwhile: impl FnOnce()) -> usize {
    let stop = AtomicBool::new(false);
    let (mut received, mut meanwhile) = (0, Some(meanwhile));
    let done = batch.compute(folder, ONE, &stop, |_| {
        received += 1;
        if received >= most {
            stop.store(true, Ordering::Relaxed);
            if let Some(meanwhile) = meanwhile.take() {
                meanwhile();
            }
        }
    });
    done.unwrap().rows
}

#[test]
fn a_worker_that_ends_loses_no_row_of_another() {
    let (folder, store, _lock, batch) = one_batch();
    let going = AtomicBool::new(false);
    let first = ended_after(&batch, folder.path(), 1, || {
        // All that the first has not done, while it is asked to stop.
        let second = batch.compute(folder.path(), ONE, &going, |_| ()).unwrap();
        assert!(second.rows > 0);
        assert_eq!(store.read().unwrap().rows.len(), 24);
    });
    assert!((1..24).contains(&first), "{first}: not stopped in the middle");
    assert_eq!(store.read().unwrap().rows.len(), 24);
    assert_eq!((parts(folder.path()).len(), growing(folder.path())), (1, 0));
}

#[test]
fn a_part_is_whole_once_every_run_of_its_batch_has_a_row() {
    let (folder, store, _lock, batch) = one_batch();
    let first = ended_after(&batch, folder.path(), 3, || {
        let second = ended_after(&batch, folder.path(), 5, || ());
        assert!((5..21).contains(&second), "{second}: not stopped in the middle");
    });
    let there = store.read().unwrap().rows.len();
    assert!(there > first && there < 24, "{first}, {there}");
    assert_eq!(parts(folder.path()).len(), 0, "nothing is whole yet");
    let going = AtomicBool::new(false);
    let third = batch.compute(folder.path(), ONE, &going, |_| ()).unwrap();
    assert_eq!(third.rows, 24 - there, "what neither of the two has");
    assert_eq!((parts(folder.path()).len(), growing(folder.path())), (1, 0));
    let mut expected = rows(plan_of(SMALL).runs(), &going);
    expected.sort_by(|a, b| a.key.cmp(&b.key));
    assert_eq!(store.read().unwrap().rows, expected);
    assert_eq!(batch.compute(folder.path(), ONE, &going, |_| ()).unwrap().rows, 0);
}

#[test]
fn threads_with_the_same_batch_do_not_meet_in_one_file() {
    let (folder, store, _lock, batch) = one_batch();
    let going = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let each = || {
            batch
                .compute(folder.path(), ONE, &going, |_| ())
                .map(|done| done.rows)
        };
        let all: Vec<_> = (0..4).map(|_| scope.spawn(each)).collect();
        for worker in all {
            worker.join().unwrap().unwrap();
        }
    });
    assert_eq!(store.read().unwrap().rows.len(), 24);
    let names = fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let mut names: Vec<_> = names.collect();
    names.sort();
    assert_eq!(names.len(), 2, "the lock and a part: {names:?}");
}

#[test]
fn a_reader_needs_no_lock_while_another_makes_parts_whole() {
    let plan = plan_of(SMALL);
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(go_on(&plan, folder.path()).0.len(), 24);
    let (part, store) = (
        parts(folder.path()).remove(0),
        Store::new(folder.path(), &plan).unwrap(),
    );
    let ended = AtomicBool::new(false);
    let reads = std::thread::scope(|scope| {
        let reader = scope.spawn(|| {
            let mut reads = 0;
            while !ended.load(Ordering::Relaxed) {
                let found = store.read().unwrap();
                assert_eq!((found.rows.len(), found.damaged.len()), (24, 0));
                reads += 1;
            }
            reads
        });
        for _ in 0..100 {
            // What a worker that was killed leaves, last in the order of names, and the next worker.
            fs::copy(&part, folder.path().join("left.tmp")).unwrap();
            fs::rename(
                folder.path().join("left.tmp"),
                folder.path().join("part-z.growing"),
            )
            .unwrap();
            drop(store.lock().unwrap());
            assert_eq!(growing(folder.path()), 0);
        }
        ended.store(true, Ordering::Relaxed);
        reader.join().unwrap()
    });
    assert!(reads > 0);
    assert_eq!(parts(folder.path()).len(), 2, "the same rows are the same part");
}

#[test]
fn gains_that_follow_an_axis_make_no_other_study() {
    let with = |torques: [f64; 2], more: &[Override]| {
        let points = torques.map(|torque| {
            let replaced = vec![Override::new("vehicle.motor.stall_torque_n_m", torque)];
            let mut all = vec![
                Override::new("vehicle", "rocker_bogie6"),
                Override::new("duration_s", 0.01),
            ];
            all.extend(replaced.iter().chain(more).cloned());
            (replaced, Scenario::load("flat", &all).unwrap())
        });
        let gains = points.each_ref().map(|(_, scenario)| scenario.vehicle().gains);
        let seeds = omni_config::Seeds::Count(1);
        (
            gains,
            Plan::of_scenarios("torques", points.to_vec(), seeds).unwrap(),
        )
    };
    let folder = tempfile::tempdir().unwrap();
    let (gains, plan) = with([1.0, 2.0], &[]);
    assert_ne!(
        gains[0], gains[1],
        "the vehicle has none of its own: they follow the motor"
    );
    assert_eq!(go_on(&plan, folder.path()).0.len(), 2);
    let (_, more) = with([2.0, 3.0], &[]);
    assert_eq!(go_on(&more, folder.path()).0.len(), 1);
    // Gains that are given are a setting like others.
    let (_, given) = with(
        [2.0, 3.0],
        &[
            Override::new("vehicle.gains.kp_n_m_s_rad", 0.5),
            Override::new("vehicle.gains.ki_n_m_rad", 0.5),
        ],
    );
    let said = Store::new(folder.path(), &given)
        .unwrap()
        .read()
        .unwrap_err()
        .to_string();
    assert!(said.contains("holds results with vehicle.gains."), "{said}");
}
