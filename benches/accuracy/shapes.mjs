// The shapes of the accuracy bench: surfaces whose true normals are known. A shape takes the number of points and
// gives a sampler: a function of a source of random numbers and of six places to fill, x y z nx ny nz. Normals have
// length one; those of outliers are zero.

const TAU = 2 * Math.PI;

/** The unit sphere. */
function sphere() {
  return (random, out) => {
    direction(random, out, 0);
    for (let i = 0; i < 3; i++) out[3 + i] = out[i];
  };
}

/** The sides of a cube with edge 2, turned. */
function cube() {
  return (random, out) => {
    const [axis, side] = [Math.floor(3 * random()), random() < 0.5 ? 1 : -1];
    for (let i = 0; i < 3; i++) {
      out[i] = i === axis ? side : signed(random);
      out[3 + i] = i === axis ? side : 0;
    }
    turn(out);
  };
}

/** A torus of radii 1 and 0.35; `density` is up to 1 and takes the angle about the axis. */
const torusOf = (density) => (random, out) => {
  for (;;) {
    const [a, b] = [TAU * random(), TAU * random()];
    const ring = 1 + 0.35 * Math.cos(b);
    if (random() >= (ring / 1.35) * density(a)) continue;
    set(out, ring * Math.cos(a), ring * Math.sin(a), 0.35 * Math.sin(b));
    setNormal(out, Math.cos(b) * Math.cos(a), Math.cos(b) * Math.sin(a), Math.sin(b));
    return;
  }
};

/** Ten times as many points on one side as on the other. */
const torus = () => torusOf((a) => 0.55 + 0.45 * Math.cos(a));

/** A height field of two wavelengths. */
function terrain() {
  return (random, out) => {
    const [x, y] = [signed(random), signed(random)];
    const dx = 0.6 * Math.cos(3 * x) * Math.cos(3 * y) + 0.386 * Math.cos(19.3 * x);
    const dy = -0.6 * Math.sin(3 * x) * Math.sin(3 * y);
    set(out, x, y, 0.2 * Math.sin(3 * x) * Math.cos(3 * y) + 0.02 * Math.sin(19.3 * x));
    setNormal(out, -dx, -dy, 1);
  };
}

/** Two parallel sheets of 2 by 2, 0.03 apart (3.4 point spacings at 100,000 points), turned; no rim. */
function plate() {
  return (random, out) => {
    const side = random() < 0.5 ? 1 : -1;
    set(out, signed(random), signed(random), 0.015 * side);
    setNormal(out, 0, 0, side);
    turn(out);
  };
}

/** A closed cylinder of radius 1 and height 2.5, turned. */
function cylinder() {
  const [side, caps] = [2.5, 1];
  return (random, out) => {
    const a = TAU * random();
    if (random() * (side + caps) < side) {
      set(out, Math.cos(a), Math.sin(a), 1.25 * signed(random));
      setNormal(out, Math.cos(a), Math.sin(a), 0);
    } else {
      const [r, end] = [Math.sqrt(random()), random() < 0.5 ? 1 : -1];
      set(out, r * Math.cos(a), r * Math.sin(a), 1.25 * end);
      setNormal(out, 0, 0, end);
    }
    turn(out);
  };
}

/** A cone of radius 1 and height 2 with its base, turned. */
function cone() {
  const slant = Math.sqrt(5);
  return (random, out) => {
    const [a, r] = [TAU * random(), Math.sqrt(random())];
    const isSide = random() * (slant + 1) < slant;
    set(out, r * Math.cos(a), r * Math.sin(a), isSide ? 2 * (1 - r) : 0);
    if (isSide) setNormal(out, 2 * Math.cos(a), 2 * Math.sin(a), 1);
    else setNormal(out, 0, 0, -1);
    turn(out);
  };
}

/** A tube along a bent axis, of radius 0.14 to 0.26. */
function tube() {
  const axis = (t) => [2 * t, 0.5 * Math.sin(2.2 * t), 0.3 * Math.cos(3.1 * t)];
  return surface([-1, 1], [0, TAU], (t, a) => {
    const [c, before, after] = [axis(t), axis(t - 1e-4), axis(t + 1e-4)];
    const along = unit(after.map((value, i) => value - before[i]));
    const u = unit(cross(along, [0, 0, 1]));
    const v = cross(along, u);
    const r = 0.2 + 0.06 * Math.sin(11 * t);
    return c.map((value, i) => value + r * (Math.cos(a) * u[i] + Math.sin(a) * v[i]));
  });
}

/** The corner of a room: a floor, two walls of 2 by 2, and three boxes: one alone, one turned, one against a wall. */
function room() {
  const boxes = [
    { centre: [1.5, 0.5, 0.2], half: [0.3, 0.25, 0.2], angle: 0, against: false },
    { centre: [1.1, 1.3, 0.25], half: [0.25, 0.4, 0.25], angle: 0.5, against: false },
    { centre: [0.2, 0.7, 0.6], half: [0.2, 0.3, 0.6], angle: 0, against: true },
  ];
  const local = ({ centre, angle }, [x, y, z]) => {
    const [dx, dy, c, s] = [x - centre[0], y - centre[1], Math.cos(angle), Math.sin(angle)];
    return [c * dx + s * dy, c * dy - s * dx, z - centre[2]];
  };
  // What a box stands on or leans against is no surface of the room.
  const isHidden = (point) => boxes.some((box) => local(box, point).every((d, i) => Math.abs(d) < box.half[i] + 1e-9));
  const faces = [0, 1, 2].map((axis) => {
    const [u, v, normal] = [(axis + 1) % 3, (axis + 2) % 3, axis].map((i) => [0, 1, 2].map((j) => Number(i === j)));
    return { middle: u.map((_, i) => u[i] + v[i]), u, v, normal, area: 4, ofRoom: true };
  });
  for (const { centre, half, angle, against } of boxes) {
    const [c, s] = [Math.cos(angle), Math.sin(angle)];
    const axes = [
      [c, s, 0],
      [-s, c, 0],
      [0, 0, 1],
    ];
    for (let axis = 0; axis < 3; axis++) {
      for (const side of [-1, 1]) {
        if (side === -1 && (axis === 2 || (axis === 0 && against))) continue;
        const [j, k] = [(axis + 1) % 3, (axis + 2) % 3];
        faces.push({
          middle: centre.map((value, i) => value + side * half[axis] * axes[axis][i]),
          u: axes[j].map((value) => value * half[j]),
          v: axes[k].map((value) => value * half[k]),
          normal: axes[axis].map((value) => side * value),
          area: 4 * half[j] * half[k],
          ofRoom: false,
        });
      }
    }
  }
  const total = faces.reduce((sum, { area }) => sum + area, 0);
  return (random, out) => {
    for (;;) {
      let left = random() * total;
      const face = faces.find(({ area }) => (left -= area) < 0) ?? faces[0];
      const [s, t] = [signed(random), signed(random)];
      const point = face.middle.map((value, i) => value + s * face.u[i] + t * face.v[i]);
      if (face.ofRoom && isHidden(point)) continue;
      set(out, ...point);
      setNormal(out, ...face.normal);
      turn(out);
      return;
    }
  };
}

/** One and a half turns of a helicoid of radius 1. */
const helicoid = () => surface([-1, 1], [0, 1.5 * TAU], (r, a) => [r * Math.cos(a), r * Math.sin(a), 0.3 * a]);

/** The unit sphere with 60 knobs and 60 dents: half balls, 10 to 20 point spacings wide at 100,000 points. */
function details() {
  const balls = Array.from({ length: 120 }, (_, i) => {
    const z = 1 - (2 * i + 1) / 120;
    const [ring, a] = [Math.sqrt(1 - z * z), i * Math.PI * (3 - Math.sqrt(5))];
    const spacing = Math.sqrt((2 * TAU) / 100_000);
    return { centre: [ring * Math.cos(a), ring * Math.sin(a), z], r: (5 + (i % 6)) * spacing, isKnob: i % 2 === 0 };
  });
  const areas = balls.map(({ r }) => 2 * TAU * r * r);
  const total = 2 * TAU + areas.reduce((sum, area) => sum + area);
  const isIn = ({ centre, r }, out) => Math.hypot(...centre.map((c, i) => out[i] - c)) < r;
  const at = new Float64Array(3);
  return (random, out) => {
    for (;;) {
      let left = random() * total - 2 * TAU;
      direction(random, at, 0);
      const ball = left >= 0 && balls.find((_, i) => (left -= areas[i]) < 0);
      if (ball) {
        set(out, ...ball.centre.map((c, i) => c + ball.r * at[i]));
        // Knobs end at the sphere from outside, dents from inside.
        if (Math.hypot(out[0], out[1], out[2]) > 1 !== ball.isKnob) continue;
        const side = ball.isKnob ? 1 : -1;
        setNormal(out, side * at[0], side * at[1], side * at[2]);
        return;
      }
      set(out, ...at);
      if (balls.some((ball) => isIn(ball, out))) continue;
      setNormal(out, ...at);
      return;
    }
  };
}

/** An undulating surface of 2 by 2, scanned in lines: the points are 20 times as dense along a line as across. */
function lines(count) {
  const number = Math.max(2, Math.round(Math.sqrt(count / 20)));
  return (random, out) => {
    // Lines are not drawn with a ruler: a fifth of a spacing along the line.
    const x = (2 * (Math.floor(number * random()) + 0.5 + 0.01 * signed(random))) / number - 1;
    const y = signed(random);
    const dx = 0.6 * Math.cos(3 * x + 0.4) * Math.cos(2.5 * y);
    const dy = -0.5 * Math.sin(3 * x + 0.4) * Math.sin(2.5 * y) + 0.18 * Math.cos(6 * y);
    set(out, x, y, 0.2 * Math.sin(3 * x + 0.4) * Math.cos(2.5 * y) + 0.03 * Math.sin(6 * y));
    setNormal(out, -dx, -dy, 1);
  };
}

/** An even torus of which 2 % of the points are anywhere in 1.2 times its box. */
function outliers() {
  const surface = torusOf(() => 1);
  return (random, out) => {
    if (random() >= 0.02) return surface(random, out);
    set(out, 1.62 * signed(random), 1.62 * signed(random), 0.42 * signed(random));
    out.fill(0, 3);
  };
}

export const SHAPES = {
  sphere,
  cube,
  torus,
  terrain,
  plate,
  cylinder,
  cone,
  tube,
  room,
  helicoid,
  details,
  lines,
  outliers,
};

/** A surface given by two parameters, evenly covered; normals by central differences, right to 1e-6 degrees. */
function surface([uLow, uHigh], [vLow, vHigh], place) {
  const step = 1e-5;
  const difference = (a, b) => a.map((value, i) => (value - b[i]) / (2 * step));
  const normalAt = (u, v) =>
    cross(difference(place(u + step, v), place(u - step, v)), difference(place(u, v + step), place(u, v - step)));
  let most = 0;
  for (let i = 0; i <= 100; i++) {
    for (let j = 0; j <= 100; j++) {
      const [u, v] = [uLow + ((uHigh - uLow) * i) / 100, vLow + ((vHigh - vLow) * j) / 100];
      most = Math.max(most, Math.hypot(...normalAt(u, v)));
    }
  }
  return (random, out) => {
    for (;;) {
      const [u, v] = [uLow + (uHigh - uLow) * random(), vLow + (vHigh - vLow) * random()];
      const normal = normalAt(u, v);
      if (random() * 1.02 * most > Math.hypot(...normal)) continue;
      set(out, ...place(u, v));
      setNormal(out, ...normal);
      return;
    }
  };
}

const signed = (random) => 2 * random() - 1;
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((value) => value / Math.hypot(...a));

function direction(random, out) {
  const [z, a] = [signed(random), TAU * random()];
  const ring = Math.sqrt(1 - z * z);
  out[0] = ring * Math.cos(a);
  out[1] = ring * Math.sin(a);
  out[2] = z;
}

function set(out, x, y, z) {
  out[0] = x;
  out[1] = y;
  out[2] = z;
}

function setNormal(out, x, y, z) {
  const length = Math.hypot(x, y, z);
  out[3] = x / length;
  out[4] = y / length;
  out[5] = z / length;
}

/** A rotation about no special axis, of the point and of its normal. */
function turn(out) {
  const [c, s, e, f] = [Math.cos(0.7), Math.sin(0.7), Math.cos(0.6), Math.sin(0.6)];
  for (const at of [0, 3]) {
    const [x, y, z] = [c * out[at] - s * out[at + 1], s * out[at] + c * out[at + 1], out[at + 2]];
    out[at] = x;
    out[at + 1] = e * y - f * z;
    out[at + 2] = f * y + e * z;
  }
}
