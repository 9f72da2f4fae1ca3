//! Layers of images: convolution, depthwise convolution and pooling.

use super::Import;
use super::file::Operator;
use crate::import::groups::{self, MAX_UNGROUPED};
use crate::import::pads;
use crate::{Convolution, NetworkError, Op, Window};

impl Import<'_> {
    fn image(&self, x: usize, name: &str) -> Result<[usize; 2], NetworkError> {
        match *self.network.nodes[x].shape.as_slice() {
            [rows, columns, _] => Ok([rows, columns]),
            [columns, _] => Ok([1, columns]),
            ref other => Err(NetworkError::malformed(
                name,
                format!("{other:?} is no image"),
            )),
        }
    }

    fn window(
        &self,
        operator: &Operator<'_>,
        image: [usize; 2],
        size: [usize; 2],
        dilated: Option<[usize; 2]>,
    ) -> Result<Window, NetworkError> {
        let Some(options) = operator.options else {
            return Err(NetworkError::malformed("model", "a window without options"));
        };
        let number = |id: usize, otherwise: i32| -> Result<usize, NetworkError> {
            Ok(usize::try_from(options.int(id, otherwise)?).unwrap_or(0))
        };
        let stride = [number(2, 0)?, number(1, 0)?];
        let dilation = match dilated {
            Some([rows, columns]) => [number(rows, 1)?, number(columns, 1)?],
            None => [1, 1],
        };
        let mut window = Window {
            size,
            stride,
            dilation,
            before: [0; 2],
            after: [0; 2],
        };
        if options.byte(0)? == 0 {
            for axis in 0..2 {
                let (before, after) =
                    pads::same(image[axis], size[axis], stride[axis], dilation[axis]);
                (window.before[axis], window.after[axis]) = (before, after);
            }
        }
        Ok(window)
    }

    pub(super) fn convolution(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
    ) -> Result<usize, NetworkError> {
        let x = self.value(operator, 0, name)?;
        let image = self.image(x, name)?;
        let weights = self.weights(operator, 1, name)?;
        weights.expect_axes(name, 4)?;
        let channels = self.network.nodes[x].shape.last().copied().unwrap_or(1);
        let size = [weights.shape[1], weights.shape[2]];
        let window = self.window(operator, image, size, Some([5, 4]))?;
        let bias = self.bias(operator, weights.shape[0], name)?;
        let weights = groups::ungrouped(name, weights.clone(), channels)?.values;
        self.network.push(
            name,
            Op::Convolution(Convolution {
                window,
                weights,
                bias,
            }),
            vec![x],
        )
    }

    pub(super) fn pool(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
    ) -> Result<(usize, Window), NetworkError> {
        let x = self.value(operator, 0, name)?;
        let image = self.image(x, name)?;
        let number = |id: usize| operator.options.map_or(Ok(0), |options| options.int(id, 0));
        let size = [number(4)?, number(3)?].map(|n| usize::try_from(n).unwrap_or(0));
        Ok((x, self.window(operator, image, size, None)?))
    }

    /// A convolution of each channel by itself, as one over all channels with zeros between them.
    pub(super) fn depthwise(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
    ) -> Result<usize, NetworkError> {
        let x = self.value(operator, 0, name)?;
        let image = self.image(x, name)?;
        let weights = self.weights(operator, 1, name)?;
        weights.expect_axes(name, 4)?;
        let (size, filters) = ([weights.shape[1], weights.shape[2]], weights.shape[3]);
        let channels = self.network.nodes[x].shape.last().copied().unwrap_or(1);
        let places = size[0].saturating_mul(size[1]);
        if weights.shape[0] != 1 || !filters.is_multiple_of(channels) {
            return Err(NetworkError::malformed(
                name,
                format!(
                    "weights of shape {:?} for {channels} channels",
                    weights.shape
                ),
            ));
        }
        if places.saturating_mul(filters).saturating_mul(channels) > MAX_UNGROUPED {
            return Err(NetworkError::unsupported(
                name,
                format!("DEPTHWISE_CONV_2D of {filters} filters"),
                "use Conv2D",
            ));
        }
        let mut full = vec![0.0; filters * places * channels];
        for (i, &w) in weights.values.iter().enumerate() {
            let (place, filter) = (i / filters, i % filters);
            let channel = filter / (filters / channels);
            full[(filter * places + place) * channels + channel] = w;
        }
        let window = self.window(operator, image, size, Some([6, 5]))?;
        let bias = self.bias(operator, filters, name)?;
        let op = Op::Convolution(Convolution {
            window,
            weights: full,
            bias,
        });
        self.network.push(name, op, vec![x])
    }
}
