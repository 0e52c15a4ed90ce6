//! Command.
use harness::*;
use std::path::PathBuf;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let catalog = sim_core::effects::standard();
    let t = std::time::Instant::now();
    let prog = |s: &str| if std::env::var("V").is_ok() { println!("  .. {s} {:?}", t.elapsed()) };
    if args[1] == "emps" {
        let map = recording::Map::parse("emps", &std::fs::read_to_string("/work/main/fixtures/maps/emps.toml").unwrap()).unwrap();
        let opts = recording::ReadOptions { map, ..Default::default() };
        let r = |n: &str| recording::read(&PathBuf::from(n), &opts).map_err(|e| println!("{e}")).unwrap();
        let mut a = vec![r("/work/shared/data/real/emps/DATA_EMPS.csv")]; let mut b = vec![r("/work/shared/data/real/emps/DATA_EMPS_PULSES.csv")];
        if args.len() > 2 { std::mem::swap(&mut a, &mut b); }
        let m = model::from_session(&a[0]).unwrap();
        let o = diagnose::diagnose(&diagnose::Request { model: &m, catalog: &catalog, learn: &a, aux: &[], test: &b, rules: Default::default(), progress: &prog }).map_err(|e| println!("{e}")).unwrap();
        for s in &o.diagnosis.sentences { println!("   {s}"); }
        for r in o.diagnosis.ranking.iter().take(30) { println!("{} {:22} {:9.1} {:?} {} {}", r.step, r.effect, r.gain, r.held_out_gain, r.wins, r.accepted); }
        println!("{:?} {:?}", o.diagnosis.groups, o.diagnosis.base_parameters);
        println!("{:?} {:?}", o.ladder, t.elapsed());
        return;
    }
    let dir = PathBuf::from(&args[1]);
    let opts = recording::ReadOptions::default();
    let read = |n: &str| recording::read(&dir.join(n), &opts).map_err(|e| println!("{e}")).unwrap();
    let all = |v: &[&str]| v.iter().map(|n| read(n)).collect::<Vec<_>>();
    let learn = all(&["learn_01.mcap","learn_02.mcap","learn_03.mcap","learn_04.mcap","learn_05.mcap","learn_06.mcap"]);
    let aux = all(&["excite.mcap","static.mcap"]);
    let test = all(&["test_07.mcap","test_08.mcap","test_09.mcap"]);
    let m = model::from_session(&learn[0]).unwrap();
    let o = diagnose::diagnose(&diagnose::Request { model: &m, catalog: &catalog, learn: &learn, aux: &aux, test: &test, rules: Default::default(), progress: &prog });
    let o = match o { Ok(o) => o, Err(e) => { println!("ERROR {e}"); return; } };
    let d = &o.diagnosis;
    println!("VERDICT {} misfit {:.3} -> {:.3}  {:.1}s", d.verdict.id(), d.misfit_before, d.misfit_after, t.elapsed().as_secs_f64());
    for s in &d.sentences { println!("   {s}"); }
    for g in &d.groups { println!("  GROUP {:?} {:?} {:?} gain {:.0}", g.effects, g.alternatives, g.parameters, g.held_out_gain); }
    for (k,t) in &d.test { println!("  TEST {k} {:.3e} {:.3e} floor {:.3e} ratio {:.3}", t.before, t.after, t.noise_floor, t.after/t.noise_floor); }
    for s in &d.sessions { for n in &s.notes { println!("  NOTE {} {} {n}", s.file, s.odd); } }
    if std::env::var("V").is_ok() {
      for r in d.ranking.iter().filter(|r| r.gain > 3.0) { println!("{} {:22} {:9.1} {:?} {} {}", r.step, r.effect, r.gain, r.held_out_gain, r.wins, r.accepted); }
      for c in &d.map { println!("{:?} {:?} {:.2} {:.2} {}", c.phase, c.channel, c.before, c.after, c.blocks); }
      println!("{:?} {:?}", d.noise, d.scatter); println!("{:?}", d.not_visible_below);
    }
}
