//! The nominal model, written from a recording's own `session` record: what its operator believes.

use super::{
    ContactModel, LawModel, Model, Parts, PlantModel, ReadoutModel, ReleaseModel, Repeatability, RigKind, SensorModel,
    TimingModel, VirtualContactModel,
};
use crate::error::Error;
use crate::recording::{Kind, Session};
use sim_core::compensator::Compensation;
use sim_core::plant::PointIntegrator;

/// The model of the cell that this recording's operator describes.
pub fn from_session(session: &Session) -> Result<Model, Error> {
    session.along_one_axis()?;
    if session.kind == Kind::Drive {
        return drive(session);
    }
    let need = |key: &str| session.believed_f64(key);
    let or = |key: &str, default: f64| session.believed_f64_or(key, default);
    let bias = session.believed_vec("ft_bias")?;
    let bias_n = bias.get(2).copied().ok_or_else(|| {
        Error::new("ft_bias has fewer than three numbers").file(&session.file).place("metadata record session")
    })?;
    let default = TimingModel::default();
    let sensor_period_s = or("ft_period_s", default.sensor_period_s)?;
    let mut model = Model {
        schema: 1,
        name: "nominal".into(),
        rig: RigKind::Docking,
        plant: PlantModel { mass_kg: need("reduced_mass_kg")?, integrator: PointIntegrator::default() },
        contact: ContactModel {
            stiffness_n_per_m: need("device_stiffness_n_per_m")?,
            damping_n_s_per_m: need("device_damping_n_s_per_m")?,
            offset_n: 0.0,
            release: ReleaseModel::default(),
            law: LawModel::default(),
        },
        timing: TimingModel {
            command_delay_s: need("command_delay_s")?,
            measurement_delay_s: need("measurement_delay_s")?,
            loop_period_s: or("loop_period_s", default.loop_period_s)?,
            sensor_period_s,
            physics_step_s: sensor_period_s,
        },
        virtual_contact: VirtualContactModel {
            stiffness_n_per_m: or("virtual_stiffness_n_per_m", 0.0)?,
            damping_n_s_per_m: or("virtual_damping_n_s_per_m", 0.0)?,
            dead_band_n: or("dead_band_n", 0.5)?,
            ..VirtualContactModel::default()
        },
        sensor: SensorModel {
            tool_mass_kg: need("tool_mass_kg")?,
            bias_n,
            white_sigma_n: or("ft_force_sigma_n", 0.0)?,
            slow_sigma_n: or("ft_force_slow_sigma_n", 0.0)?,
            calibration: None,
        },
        readout: ReadoutModel { position_sigma_m: or("position_sigma_m", 0.0)? },
        compensation: Compensation::default(),
        robot: None,
        repeatability: Repeatability::default(),
        effects: Vec::new(),
    };
    if let Some(text) = session.believed.get(Parts::KEY) {
        let parts = Parts::parse(text).map_err(|what| {
            let error = Error::new(format!("`{}` cannot be read: {what}", Parts::KEY)).file(&session.file);
            error.place("metadata record session").help("leave the key out and add the parts to the model by hand")
        })?;
        parts.put(&mut model);
    }
    Ok(model)
}

/// A drive says nothing of itself: the mass and the friction are found by the first fit.
fn drive(session: &Session) -> Result<Model, Error> {
    let measured = session.measured.as_ref().ok_or_else(|| {
        Error::new("a drive without a measured position")
            .file(&session.file)
            .help("name the column in the map: measured = …")
    })?;
    let period_ns = crate::case::median_period_ns(&measured.time_ns);
    let period_s = (period_ns as f64 * 1e-6).round() * 1e-3;
    Ok(Model {
        schema: 1,
        name: "nominal".into(),
        rig: RigKind::Drive,
        plant: PlantModel {
            mass_kg: session.believed_f64_or("mass_kg", 100.0)?,
            integrator: PointIntegrator::default(),
        },
        contact: ContactModel {
            stiffness_n_per_m: 0.0,
            damping_n_s_per_m: session.believed_f64_or("damping_n_s_per_m", 100.0)?,
            offset_n: 0.0,
            release: ReleaseModel::default(),
            law: LawModel::default(),
        },
        timing: TimingModel {
            loop_period_s: period_s,
            sensor_period_s: period_s,
            physics_step_s: period_s,
            ..TimingModel::default()
        },
        virtual_contact: VirtualContactModel::default(),
        sensor: SensorModel::default(),
        readout: ReadoutModel::default(),
        compensation: Compensation::default(),
        robot: None,
        repeatability: Repeatability::default(),
        effects: Vec::new(),
    })
}
