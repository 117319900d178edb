//! Prints the error of the attitude of a tumbling cuboid after 10 s.
#[link(name = "step", kind = "static")]
extern "C" {
    fn kr_step(
        moments: *const f64,
        q: *mut f64,
        m: *mut f64,
        impulse: *const f64,
        h: f64,
        order: i32,
    );
    fn kr_step_momentum(moments: *const f64, q: *const f64, w: *const f64, m: *mut f64);
}

struct Body {
    moments: [f64; 3],  // about the principal axes [kg m^2]
    attitude: [f64; 4], // w, x, y, z; from the principal axes to space
    momentum: [f64; 3], // in space [kg m^2 / s]
}

impl Body {
    fn new(moments: [f64; 3], velocity: [f64; 3]) -> Body {
        let mut body = Body {
            moments,
            attitude: [1.0, 0.0, 0.0, 0.0],
            momentum: [0.0; 3],
        };
        let (q, m) = (body.attitude.as_ptr(), body.momentum.as_mut_ptr());
        unsafe { kr_step_momentum(moments.as_ptr(), q, velocity.as_ptr(), m) };
        body
    }
    fn step(&mut self, impulse: [f64; 3], seconds: f64) {
        let (q, m) = (self.attitude.as_mut_ptr(), self.momentum.as_mut_ptr());
        unsafe { kr_step(self.moments.as_ptr(), q, m, impulse.as_ptr(), seconds, 4) };
    }
}

fn main() {
    let mut body = Body::new([0.1 / 3.0, 0.26 / 3.0, 0.34 / 3.0], [3.0, 1.0, 2.0]);
    for _ in 0..600 {
        body.step([0.0; 3], 1.0 / 60.0);
    }
    // The closed form
    let truth = [
        -0.0710009187614268,
        0.42939487137885635,
        0.866475553493763,
        0.24453840018746675,
    ];
    let square: f64 = (0..4).map(|i| (body.attitude[i] - truth[i]).powi(2)).sum();
    println!("error after 10 s: {:.1e} rad", 2.0 * square.sqrt());
}
