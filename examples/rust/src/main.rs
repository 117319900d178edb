use kreisel_example::{Body, Error, Method, Quat, Scene, Shaking, State, Top, Vec3};

fn main() -> Result<(), Error> {
    // A disk on a light axle in SI units, tilted by 60 degrees, with 3000 turns a minute.
    let tilt = 60f64.to_radians();
    let momentum = 314.159 * 6.25e-4; // spin times moment
    let scene = Scene {
        body: Body::symmetric(0.5, 7.5125e-3, 6.25e-4, 0.12)?,
        gravity: 9.81,
        start: State {
            t: 0.0,
            q: Quat {
                w: (tilt / 2.0).cos(),
                x: (tilt / 2.0).sin(),
                y: 0.0,
                z: 0.0,
            },
            m: Vec3 {
                x: 0.0,
                y: -momentum * tilt.sin(),
                z: momentum * tilt.cos(),
            },
        },
        damping: Vec3 {
            x: 0.0,
            y: 0.0,
            z: 0.0,
        },
        turning: Vec3 {
            x: 0.0,
            y: 0.0,
            z: 0.0,
        },
        shaking: Shaking::default(),
        friction: 0.0,
        wheels: Default::default(),
        gradient: 0.0,
    };
    let mut top = Top::new(&scene, Method::taylor(), 0.0)?;
    let state = top.advance(1.0)?;
    println!("t = {}: tilt {:.9}", state.t, scene.nutation(&state));
    if let Err(error) = Top::new(&scene, Method::strang(), 0.0) {
        println!("refused: {error}"); // a fixed-step method without step
    }
    Ok(())
}
