//! Lights that come, move and go once an index is built.
//!
//! In: a light. Out: values for it of which nothing is known, or none. Invariant: what is known of the other lights
//! stays, and they keep their order.

use antumbra_geometry::{LightShape, Occluders};

use super::{AdaptiveValues, LightValues, NO_LIGHT, is_ordinary};

impl AdaptiveValues {
    /// Prepares values of one light. Nothing is known yet.
    pub(super) fn new_light(&self, occluders: &Occluders, light: &LightShape) -> LightValues {
        // Filters square directions.
        let light = light.without_underflow();
        LightValues::new(light, is_ordinary(occluders, &self.frame, &light))
    }

    /// Adds a light behind all others.
    pub(crate) fn add_light(&mut self, occluders: &Occluders, light: &LightShape) {
        let light = self.new_light(occluders, light);
        self.lights.push(light);
    }

    /// Puts another light in the place of one.
    pub(crate) fn replace_light(
        &mut self,
        occluders: &Occluders,
        number: usize,
        light: &LightShape,
    ) {
        self.drop_known(number);
        self.lights[number] = self.new_light(occluders, light);
    }

    /// Removes a light; those behind it move up.
    pub(crate) fn remove_light(&mut self, number: usize) {
        self.drop_known(number);
        self.lights.remove(number);
        for holder in &mut *self.holders() {
            *holder -= usize::from(*holder > number);
        }
        *self.asked_last.get_mut() = NO_LIGHT;
    }
}
