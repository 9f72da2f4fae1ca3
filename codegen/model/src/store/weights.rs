//! `weights.safetensors`: for layer `i`, `layer.i.weights` (f32, outputs x inputs) and
//! `layer.i.bias` (f32, outputs), of a recurrent one `layer.i.kernel`, `.recurrent`, `.bias` and
//! `.inner_bias`; with `shortcut = true` also `shortcut.weights` (f32, outputs x regressor);
//! of a soft sensor `soft_sensor.bias` (f32, outputs), `.linear` (f32, outputs x channels) and
//! `.quadratic` (f32, outputs x products of two channels), with `watched = true` also
//! `soft_sensor.watch.bias` and `.spread` (f32, channels) and `.weights` (f32, channels x
//! channels);
//! of a model with a state `measurement.weights` (f32, measurements x states) and `.bias`;
//! optionally `golden.x` (f32) and `golden.y` (f64), one row each.

use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};

use super::StoreError;
use crate::spec::limits::MAX_GOLDEN;
use crate::spec::{Dense, Golden, ModelSpec, SoftSensorSpec};

const SHORTCUT: &str = "shortcut.weights";
const MEASUREMENT: &str = "measurement.weights";
const MEASUREMENT_BIAS: &str = "measurement.bias";
const SENSOR_BIAS: &str = "soft_sensor.bias";
const SENSOR_LINEAR: &str = "soft_sensor.linear";
const SENSOR_QUADRATIC: &str = "soft_sensor.quadratic";
const WATCH_BIAS: &str = "soft_sensor.watch.bias";
const WATCH_WEIGHTS: &str = "soft_sensor.watch.weights";
const WATCH_SPREAD: &str = "soft_sensor.watch.spread";
const GOLDEN_X: &str = "golden.x";
const GOLDEN_Y: &str = "golden.y";

/// Gives the layers of `spec` their weights, and `spec` its golden vectors.
pub(super) fn fill(spec: &mut ModelSpec, bytes: &[u8]) -> Result<(), StoreError> {
    let file = SafeTensors::deserialize(bytes)
        .map_err(|error| StoreError::weights(format!("this is no safetensors file: {error}")))?;
    let mut known = Vec::new();
    for (index, layer) in spec.layers.iter_mut().enumerate() {
        for (name, shape, values) in layer.tensors_mut() {
            let name = format!("layer.{index}.{name}");
            *values = f32s(tensor(&file, &name, Dtype::F32, &shape)?);
            known.push(name);
        }
    }
    if spec.skip.is_some() {
        let shape = [spec.predicted_len(), spec.regressor_len()];
        spec.skip = Some(f32s(tensor(&file, SHORTCUT, Dtype::F32, &shape)?));
        known.push(SHORTCUT.into());
    }
    if let Some(state) = &mut spec.state {
        let measurement = &mut state.measurement;
        let shape = [measurement.outputs, measurement.inputs];
        measurement.weights = f32s(tensor(&file, MEASUREMENT, Dtype::F32, &shape)?);
        measurement.bias = f32s(tensor(&file, MEASUREMENT_BIAS, Dtype::F32, &shape[..1])?);
        known.extend([MEASUREMENT.into(), MEASUREMENT_BIAS.into()]);
    }
    let (n_y, n_s) = (spec.outputs.len(), spec.channels.len());
    if let Some(sensor) = &mut spec.soft_sensor {
        let n_q = SoftSensorSpec::products(n_s);
        sensor.bias = f32s(tensor(&file, SENSOR_BIAS, Dtype::F32, &[n_y])?);
        sensor.linear = f32s(tensor(&file, SENSOR_LINEAR, Dtype::F32, &[n_y, n_s])?);
        sensor.quadratic = f32s(tensor(&file, SENSOR_QUADRATIC, Dtype::F32, &[n_y, n_q])?);
        known.extend([SENSOR_BIAS, SENSOR_LINEAR, SENSOR_QUADRATIC].map(String::from));
        if let Some(watch) = &mut sensor.watch {
            watch.bias = f32s(tensor(&file, WATCH_BIAS, Dtype::F32, &[n_s])?);
            watch.weights = f32s(tensor(&file, WATCH_WEIGHTS, Dtype::F32, &[n_s, n_s])?);
            watch.spread = f32s(tensor(&file, WATCH_SPREAD, Dtype::F32, &[n_s])?);
            known.extend([WATCH_BIAS, WATCH_WEIGHTS, WATCH_SPREAD].map(String::from));
        }
    }
    if file.tensor(GOLDEN_X).is_ok() || file.tensor(GOLDEN_Y).is_ok() {
        spec.golden = golden(spec, &file)?;
        known.extend([GOLDEN_X.into(), GOLDEN_Y.into()]);
    }
    let mut names = file.names();
    names.sort_unstable();
    match names.iter().find(|name| !known.iter().any(|k| k == *name)) {
        Some(name) => Err(StoreError::weights(format!(
            "tensor {name:?} belongs to no layer of model.toml, which has {}",
            spec.layers.len()
        ))),
        None => Ok(()),
    }
}

fn golden(spec: &ModelSpec, file: &SafeTensors<'_>) -> Result<Vec<Golden>, StoreError> {
    let rows = file
        .tensor(GOLDEN_X)
        .ok()
        .and_then(|x| x.shape().first().copied())
        .unwrap_or(0);
    if rows > MAX_GOLDEN {
        return Err(StoreError::weights(format!(
            "tensor {GOLDEN_X:?} has {rows} rows: at most {MAX_GOLDEN} are kept"
        )));
    }
    let (n_x, n_y) = (spec.point_len(), spec.predicted_len());
    let x = f32s(tensor(file, GOLDEN_X, Dtype::F32, &[rows, n_x])?);
    let y = f64s(tensor(file, GOLDEN_Y, Dtype::F64, &[rows, n_y])?);
    // chunks(0) panics; a model without signals is refused by validate, which comes after this.
    let pairs = x.chunks(n_x.max(1)).zip(y.chunks(n_y.max(1)));
    Ok(pairs
        .map(|(x, y)| Golden {
            x: x.to_vec(),
            y: y.to_vec(),
        })
        .collect())
}

fn tensor<'a>(
    file: &SafeTensors<'a>,
    name: &str,
    dtype: Dtype,
    shape: &[usize],
) -> Result<&'a [u8], StoreError> {
    let tensor: TensorView<'a> = file
        .tensor(name)
        .map_err(|_| StoreError::weights(format!("tensor {name:?} is missing")))?;
    if tensor.dtype() != dtype || tensor.shape() != shape {
        return Err(StoreError::weights(format!(
            "tensor {name:?} is {} {:?}: model.toml makes it {dtype} {shape:?}",
            tensor.dtype(),
            tensor.shape()
        )));
    }
    Ok(tensor.data())
}

/// `weights.safetensors` of `spec`; the same model gives the same bytes.
pub(super) fn print(spec: &ModelSpec) -> Result<Vec<u8>, StoreError> {
    let mut tensors: Vec<(String, Dtype, Vec<usize>, Vec<u8>)> = Vec::new();
    for (index, layer) in spec.layers.iter().enumerate() {
        for (name, shape, values) in layer.tensors() {
            let name = format!("layer.{index}.{name}");
            tensors.push((name, Dtype::F32, shape, bytes_of(values)));
        }
    }
    if let Some(weights) = &spec.skip {
        let shape = vec![spec.predicted_len(), spec.regressor_len()];
        tensors.push((SHORTCUT.into(), Dtype::F32, shape, bytes_of(weights)));
    }
    if let Some(state) = &spec.state {
        let Dense {
            inputs,
            outputs,
            weights,
            bias,
            ..
        } = &state.measurement;
        let shape = vec![*outputs, *inputs];
        tensors.push((MEASUREMENT.into(), Dtype::F32, shape, bytes_of(weights)));
        let shape = vec![*outputs];
        tensors.push((MEASUREMENT_BIAS.into(), Dtype::F32, shape, bytes_of(bias)));
    }
    if let Some(sensor) = &spec.soft_sensor {
        let (n_y, n_s) = (spec.outputs.len(), spec.channels.len());
        let n_q = SoftSensorSpec::products(n_s);
        for (name, shape, values) in [
            (SENSOR_BIAS, vec![n_y], &sensor.bias),
            (SENSOR_LINEAR, vec![n_y, n_s], &sensor.linear),
            (SENSOR_QUADRATIC, vec![n_y, n_q], &sensor.quadratic),
        ] {
            tensors.push((name.into(), Dtype::F32, shape, bytes_of(values)));
        }
        if let Some(watch) = &sensor.watch {
            for (name, shape, values) in [
                (WATCH_BIAS, vec![n_s], &watch.bias),
                (WATCH_WEIGHTS, vec![n_s, n_s], &watch.weights),
                (WATCH_SPREAD, vec![n_s], &watch.spread),
            ] {
                tensors.push((name.into(), Dtype::F32, shape, bytes_of(values)));
            }
        }
    }
    if !spec.golden.is_empty() {
        let x: Vec<f32> = spec.golden.iter().flat_map(|g| g.x.clone()).collect();
        let y = spec.golden.iter().flat_map(|g| &g.y);
        let y: Vec<u8> = y.flat_map(|value| value.to_le_bytes()).collect();
        let rows = spec.golden.len();
        let (n_x, n_y) = (spec.point_len(), spec.predicted_len());
        tensors.push((GOLDEN_X.into(), Dtype::F32, vec![rows, n_x], bytes_of(&x)));
        tensors.push((GOLDEN_Y.into(), Dtype::F64, vec![rows, n_y], y));
    }
    let views = tensors
        .iter()
        .map(|(name, dtype, shape, data)| {
            TensorView::new(*dtype, shape.clone(), data).map(|view| (name, view))
        })
        .collect::<Result<Vec<_>, _>>();
    views
        .and_then(|views| safetensors::serialize(views, None))
        .map_err(|error| StoreError::weights(error.to_string()))
}

fn bytes_of(values: &[f32]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

fn f32s(bytes: &[u8]) -> Vec<f32> {
    let (values, _) = bytes.as_chunks();
    values.iter().map(|b| f32::from_le_bytes(*b)).collect()
}

fn f64s(bytes: &[u8]) -> Vec<f64> {
    let (values, _) = bytes.as_chunks();
    values.iter().map(|b| f64::from_le_bytes(*b)).collect()
}
