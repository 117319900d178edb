//! A safe wrapper of the part of kreisel that moves one top.

use std::ffi::CStr;
use std::fmt;
use std::os::raw::{c_char, c_int, c_void};
use std::ptr::NonNull;

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vec3 {
    pub x: f64,
    pub y: f64,
    pub z: f64,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quat {
    pub w: f64,
    pub x: f64,
    pub y: f64,
    pub z: f64,
}

/// The numbers from which a body was computed: see `kr_given`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Given {
    pub inertia: [f64; 9],
    pub com: Vec3,
    pub rotor: Vec3,
}

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Body {
    pub mass: f64,
    pub inertia: Vec3,
    pub com: Vec3,
    pub axes: Quat,
    pub rounded: f64,
    pub rotor: Vec3,
    pub given: Given,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    pub t: f64,
    pub q: Quat,
    pub m: Vec3,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Shaking {
    pub amplitude: f64,
    pub rate: f64,
    pub phase: f64,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Wheel {
    pub axis: [f64; 3],
    pub rate: f64,
}

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    pub body: Body,
    pub gravity: f64,
    pub start: State,
    pub damping: Vec3,
    pub turning: Vec3,
    pub shaking: Shaking,
    pub friction: f64,
    pub wheels: [Wheel; 3],
    pub gradient: f64,
}

#[repr(C)]
#[derive(Clone, Copy)]
struct Config {
    step: f64,
    tol: f64,
    max_steps: i64,
    poll: Option<extern "C" fn(*mut c_void) -> c_int>,
    context: *mut c_void,
    digits: c_int,
    skip_heading: c_int,
    tangents: u64,
}

/// A method of the library, such as `Method::taylor()`.
#[repr(C)]
pub struct Method {
    _private: [u8; 0],
}

#[repr(C)]
struct RawTop {
    _private: [u8; 0],
}

extern "C" {
    static kr_method_taylor: Method;
    static kr_method_strang: Method;
    fn kr_status_text(status: c_int) -> *const c_char;
    fn kr_body_symmetric(mass: f64, i1: f64, i3: f64, height: f64, body: *mut Body) -> c_int;
    fn kr_config_default() -> Config;
    fn kr_state_nutation(scene: *const Scene, state: *const State) -> f64;
    fn kr_top_create(
        scene: *const Scene,
        method: *const Method,
        config: Config,
        top: *mut *mut RawTop,
    ) -> c_int;
    fn kr_top_free(top: *mut RawTop);
    fn kr_top_advance(top: *mut RawTop, t: f64) -> c_int;
    fn kr_top_state(top: *const RawTop) -> State;
}

impl Method {
    pub fn taylor() -> &'static Method {
        unsafe { &kr_method_taylor }
    }

    pub fn strang() -> &'static Method {
        unsafe { &kr_method_strang }
    }
}

/// A status of the library other than success.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Error(c_int);

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = unsafe { CStr::from_ptr(kr_status_text(self.0)) };
        f.write_str(&text.to_string_lossy())
    }
}

impl std::error::Error for Error {}

fn check(status: c_int) -> Result<(), Error> {
    if status == 0 {
        Ok(())
    } else {
        Err(Error(status))
    }
}

impl Body {
    /// Returns a symmetric body: see `kr_body_symmetric`.
    pub fn symmetric(mass: f64, i1: f64, i3: f64, height: f64) -> Result<Body, Error> {
        let zero = Vec3 {
            x: 0.0,
            y: 0.0,
            z: 0.0,
        };
        let axes = Quat {
            w: 1.0,
            x: 0.0,
            y: 0.0,
            z: 0.0,
        };
        let mut body = Body {
            mass,
            inertia: zero,
            com: zero,
            axes,
            rounded: 0.0,
            rotor: zero,
            given: Given {
                inertia: [0.0; 9],
                com: zero,
                rotor: zero,
            },
        };
        check(unsafe { kr_body_symmetric(mass, i1, i3, height, &mut body) })?;
        Ok(body)
    }
}

impl Scene {
    /// Returns the angle between the apex and the vertical at a state.
    pub fn nutation(&self, state: &State) -> f64 {
        unsafe { kr_state_nutation(self, state) }
    }
}

/// A moving top, which frees its memory when it is dropped.
pub struct Top {
    raw: NonNull<RawTop>,
}

// A top may move to another thread, but only one thread at a time may use it.
unsafe impl Send for Top {}

impl Top {
    /// Creates a top at the start of a scene. A fixed-step method needs a step, taylor takes 0.
    pub fn new(scene: &Scene, method: &'static Method, step: f64) -> Result<Top, Error> {
        let mut raw = std::ptr::null_mut();
        unsafe {
            let mut config = kr_config_default();
            config.step = step;
            check(kr_top_create(scene, method, config, &mut raw))?;
        }
        Ok(Top {
            raw: NonNull::new(raw).expect("a top"),
        })
    }

    /// Advances to the time `t`. On failure the top keeps its last valid state.
    pub fn advance(&mut self, t: f64) -> Result<State, Error> {
        check(unsafe { kr_top_advance(self.raw.as_ptr(), t) })?;
        Ok(self.state())
    }

    pub fn state(&self) -> State {
        unsafe { kr_top_state(self.raw.as_ptr()) }
    }
}

impl Drop for Top {
    fn drop(&mut self) {
        unsafe { kr_top_free(self.raw.as_ptr()) }
    }
}
