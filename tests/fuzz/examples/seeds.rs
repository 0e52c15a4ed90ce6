//! Writes the sound inputs of every target into `corpus/`, where libFuzzer begins.

use std::path::Path;

fn main() -> std::io::Result<()> {
    for target in dockhil_fuzz::TARGETS {
        let folder = Path::new("corpus").join(target.name);
        std::fs::create_dir_all(&folder)?;
        for (number, seed) in (target.seeds)().iter().enumerate() {
            std::fs::write(folder.join(format!("seed-{number}")), seed)?;
        }
    }
    Ok(())
}
