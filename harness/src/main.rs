//! Command.
use harness::*;
use std::path::PathBuf;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let dir = PathBuf::from(&args[1]);
    let catalog = sim_core::effects::standard();
    let opts = recording::ReadOptions::default();
    let read = |n: &str| recording::read(&dir.join(n), &opts).map_err(|e| println!("{e}")).unwrap();
    let names = [
        "learn_01.mcap",
        "learn_02.mcap",
        "learn_03.mcap",
        "learn_04.mcap",
        "learn_05.mcap",
        "learn_06.mcap",
        "excite.mcap",
        "static.mcap",
    ];
    let sessions: Vec<_> = names.iter().map(|n| read(n)).collect();
    let m = model::from_session(&sessions[0]).unwrap();
    let cases: Vec<_> = sessions.iter().map(|s| case::Case::of(s, &m).unwrap()).collect();
    let noise = diagnose::noise::Noise::learn(cases.iter().find(|c| c.kind == recording::Kind::Static), &m);
    println!("{noise:?}");
    let t = std::time::Instant::now();
    let p = diagnose::problem::Problem::docking(&m, cases, noise);
    println!("problem {:?}", t.elapsed());
    let mut sc = Default::default();
    let t = std::time::Instant::now();
    for _ in 0..10 {
        for i in 0..8 {
            p.residuals(i, &p.nominal(), &[0.0; 3], &mut sc);
        }
    }
    println!("eval {:?}", t.elapsed() / 10);
    let prog = |s: &str| println!("  .. {s} {:?}", t.elapsed());
    let excl = ["command-loss", "command-jitter", "clock-offset"];
    let s = diagnose::search::Search::new(&p, &catalog, &excl, Default::default(), &prog);
    let f = s.run(&p.nominal());
    println!("total {:?}", t.elapsed());
    println!(
        "base k {} b {} cost {} n {}",
        f.base.fit.trial.base.stiffness_n_per_m,
        f.base.fit.trial.base.damping_n_s_per_m,
        f.base.fit.cost,
        f.base.total()
    );
    for r in &f.rankings {
        println!("--");
        for x in r.iter().take(8) {
            println!(
                "{:22} gain {:9.1} held {:9.1} {:?} {}",
                x.id,
                x.gain,
                x.gains.iter().sum::<f64>(),
                x.gains.iter().map(|v| v.round()).collect::<Vec<_>>(),
                x.accepted
            );
        }
    }
    for (k, v) in &f.ties {
        println!("TIE {k} {:?} worth {}", v, f.worth[k]);
    }
    for c in &f.best.fit.trial.effects {
        println!("FOUND {} {:?}", c.kind.id, c.values);
    }
    println!("sd {:?} base {:?} scatter {:?}", f.best.fit.deviations(), f.best.fit.trial.base, f.best.fit.scatter);
    println!("visible {:?}", f.visible);
}
