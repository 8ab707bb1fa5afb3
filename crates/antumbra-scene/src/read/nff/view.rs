//! NFF's `v`: the view.
//!
//! In: the words after `v`. Out: the scene's camera and its up vector. Invariant: the camera has a
//! direction, and `up` is not parallel to it.

use antumbra_geometry::{DVec3, Short};

use crate::{
    error::{Place, ReadError, ReadErrorKind},
    model::Camera,
};

use super::Reader;

impl Reader<'_> {
    /// `v` and its six records, in any order.
    pub(super) fn read_view(&mut self, line: u32) -> Result<(), ReadError> {
        const HELP: &str = "a view is `v from x y z at x y z up x y z angle a`";
        let (mut eye, mut at, mut up, mut angle, mut resolution) = (None, None, None, None, None);
        while let Some(record) = self.lexer.peek_keyword() {
            let is_known = ["from", "at", "up", "angle", "hither", "resolution"];
            if !is_known.contains(&record.text) {
                break;
            }
            self.lexer.take(record);
            let was_given = match record.text {
                "from" => eye
                    .replace(self.point("from", "3 numbers (the eye)")?)
                    .is_some(),
                "at" => at
                    .replace(self.point("at", "3 numbers (the point looked at)")?)
                    .is_some(),
                "up" => up
                    .replace(self.point("up", "3 numbers (a vector)")?)
                    .is_some(),
                "angle" => angle.replace(self.view_angle(record.line)?).is_some(),
                "hither" => {
                    self.numbers::<1>("hither", "1 number (a distance)")?;
                    false
                }
                _ => resolution.replace(self.resolution()?).is_some(),
            };
            if was_given {
                let message = format!(
                    "`{}` is given twice in one view: the last counts",
                    record.text
                );
                self.warnings.add(Place::Line(record.line), message);
            }
        }
        let missing = |name: &str| {
            let problem = format!("`{name}` is missing").into();
            self.error(
                line,
                ReadErrorKind::Invalid {
                    entity: "v",
                    problem,
                    help: HELP,
                },
            )
        };
        let camera = Camera {
            eye: eye.ok_or_else(|| missing("from"))?,
            at: at.ok_or_else(|| missing("at"))?,
            up: up.ok_or_else(|| missing("up"))?,
            vertical_fov_degrees: angle.ok_or_else(|| missing("angle"))?,
            resolution,
        };
        if let Some((problem, help)) = camera_problem(&camera) {
            return Err(self.invalid(line, "v", problem, help));
        }
        if self.scene.camera.is_some() {
            self.warnings
                .add(Place::Line(line), "another view (`v`): the last one counts");
        }
        self.scene.up = camera.up;
        self.scene.camera = Some(camera);
        Ok(())
    }

    fn view_angle(&mut self, line: u32) -> Result<f64, ReadError> {
        let [angle] = self.numbers::<1>("angle", "1 number (degrees)")?;
        if angle > 0.0 && angle < 180.0 {
            return Ok(angle);
        }
        let problem = format!(
            "expected more than 0 and less than 180 degrees, found {}",
            Short(angle)
        );
        Err(self.invalid(line, "angle", problem, "45 is usual"))
    }

    fn resolution(&mut self) -> Result<[u32; 2], ReadError> {
        const LARGEST: u32 = 1 << 16;
        let mut size = [0; 2];
        for pixels in &mut size {
            let word = self.lexer.peek();
            let number = word.and_then(|w| w.text.parse().ok());
            *pixels = number
                .filter(|n| (1..=LARGEST).contains(n))
                .ok_or_else(|| {
                    self.expected(
                        word,
                        "resolution",
                        "2 whole numbers from 1 to 65536 (width, height)",
                    )
                })?;
            self.lexer.next();
        }
        Ok(size)
    }
}

/// Returns what makes a view meaningless and what to do about it.
fn camera_problem(camera: &Camera) -> Option<(&'static str, &'static str)> {
    let forward = camera.at - camera.eye;
    if forward == DVec3::ZERO {
        return Some(("`from` and `at` are the same point", "move one of them"));
    }
    if camera.up == DVec3::ZERO {
        return Some(("`up` is zero", "`up 0 0 1` or `up 0 1 0` is usual"));
    }
    // Scaled to length about 1, so that nothing under- or overflows. Below 1e-12 the picture's
    // right would consist of rounding errors.
    let forward = forward / forward.abs().max_element();
    let up = camera.up / camera.up.abs().max_element();
    (forward.cross(up).length() < 1e-12).then_some((
        "`up` is parallel to the view direction",
        "turn `up` sideways",
    ))
}
