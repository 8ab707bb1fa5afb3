//! Vectors and homogeneous points over any [`Number`].

use glam::DVec3;

use super::Number;

/// Three coordinates.
#[derive(Clone, Debug)]
pub(crate) struct Vector<N>(pub(crate) [N; 3]);

impl<N: Number> Vector<N> {
    pub(crate) fn from_f64(v: DVec3) -> Self {
        Self([N::from_f64(v.x), N::from_f64(v.y), N::from_f64(v.z)])
    }

    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i].plus(&other.0[i])))
    }

    #[inline]
    pub(crate) fn minus(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i].minus(&other.0[i])))
    }

    #[inline]
    pub(crate) fn scaled(&self, factor: &N) -> Self {
        Self(std::array::from_fn(|i| self.0[i].times(factor)))
    }

    #[inline]
    pub(crate) fn negated(&self) -> Self {
        Self(std::array::from_fn(|i| self.0[i].negated()))
    }

    #[inline]
    pub(crate) fn dot(&self, other: &Self) -> N {
        let [a, b, c] = &self.0;
        let [d, e, f] = &other.0;
        a.times(d).plus(&b.times(e)).plus(&c.times(f))
    }

    #[inline]
    pub(crate) fn cross(&self, other: &Self) -> Self {
        let [a, b, c] = &self.0;
        let [d, e, f] = &other.0;
        Self([
            b.times(f).minus(&c.times(e)),
            c.times(d).minus(&a.times(f)),
            a.times(e).minus(&b.times(d)),
        ])
    }
}

/// A homogeneous point `(x, w)`: the point `x / w`, or with `w = 0` the direction `x`. `w >= 0`.
#[derive(Clone, Debug)]
pub(crate) struct Point4<N> {
    pub(crate) x: Vector<N>,
    pub(crate) w: N,
}

impl<N: Number> Point4<N> {
    pub(crate) fn from_f64((x, w): (DVec3, f64)) -> Self {
        Self {
            x: Vector::from_f64(x),
            w: N::from_f64(w),
        }
    }

    /// Returns `x - w origin`: the point seen from `origin`, times `w`.
    pub(crate) fn seen_from(&self, origin: &Vector<N>) -> Vector<N> {
        self.x.minus(&origin.scaled(&self.w))
    }

    /// Returns `u self + v other`.
    pub(crate) fn blend(&self, u: &N, other: &Self, v: &N) -> Self {
        Self {
            x: self.x.scaled(u).plus(&other.x.scaled(v)),
            w: self.w.times(u).plus(&other.w.times(v)),
        }
    }
}
