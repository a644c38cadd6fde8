// The jet of degree 2: a quadratic height function, fitted by least squares over the nearest points, in the frame of
// their principal components (Cazals and Pouget, "Estimating differential quantities using polynomial fitting of
// osculating jets", 2005). In double precision, as a reference; the package has no such method.

/** Coefficients of 1, u, v, u², uv, v². */
const TERMS = 6;
/** Against their sum, what is added to the squares: fits that the points leave open stay finite. */
const RIDGE = 1e-12;

/**
 * The unit normal at the first of `points` (flat, relative to it) of the jet through the first `count` of them. Zero
 * where all are in one place.
 */
export function jetNormal(points, count) {
  const scale = reach(points, count);
  if (scale === 0) return [0, 0, 0];
  const [w, v, u] = principalAxes(points, count);
  const squares = new Float64Array(TERMS * TERMS);
  const right = new Float64Array(TERMS);
  const term = new Float64Array(TERMS);
  for (let i = 0; i < 3 * count; i += 3) {
    const [x, y, z] = [points[i] / scale, points[i + 1] / scale, points[i + 2] / scale];
    const s = u[0] * x + u[1] * y + u[2] * z;
    const t = v[0] * x + v[1] * y + v[2] * z;
    const height = w[0] * x + w[1] * y + w[2] * z;
    term[0] = 1;
    term[1] = s;
    term[2] = t;
    term[3] = s * s;
    term[4] = s * t;
    term[5] = t * t;
    for (let row = 0; row < TERMS; row++) {
      right[row] += term[row] * height;
      for (let column = 0; column <= row; column++) squares[TERMS * row + column] += term[row] * term[column];
    }
  }
  const [, alongU, alongV] = solve(squares, right);
  const length = Math.hypot(alongU, alongV, 1);
  return w.map((_, axis) => (w[axis] - alongU * u[axis] - alongV * v[axis]) / length);
}

function reach(points, count) {
  let most = 0;
  for (let i = 0; i < 3 * count; i++) most = Math.max(most, Math.abs(points[i]));
  return most;
}

/** The unit eigenvectors of the covariance, that of the smallest eigenvalue first. */
export function principalAxes(points, count) {
  const mean = [0, 0, 0];
  for (let i = 0; i < 3 * count; i++) mean[i % 3] += points[i] / count;
  const matrix = [0, 1, 2].map(() => [0, 0, 0]);
  for (let i = 0; i < 3 * count; i += 3) {
    for (let row = 0; row < 3; row++) {
      for (let column = 0; column < 3; column++) {
        matrix[row][column] += (points[i + row] - mean[row]) * (points[i + column] - mean[column]);
      }
    }
  }
  const { values, vectors } = jacobi(matrix);
  return [0, 1, 2].sort((a, b) => values[a] - values[b]).map((which) => vectors.map((row) => row[which]));
}

/** Eigenvalues and, as columns, eigenvectors of a symmetric matrix, which is overwritten: Jacobi's rotations. */
function jacobi(matrix) {
  const vectors = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ];
  for (let sweep = 0; sweep < 12; sweep++) {
    for (const [p, q] of [
      [0, 1],
      [0, 2],
      [1, 2],
    ]) {
      if (matrix[p][q] === 0) continue;
      const half = (matrix[q][q] - matrix[p][p]) / (2 * matrix[p][q]);
      const tangent = Math.sign(half || 1) / (Math.abs(half) + Math.sqrt(half * half + 1));
      const cosine = 1 / Math.sqrt(tangent * tangent + 1);
      const sine = tangent * cosine;
      const turn = (first, second) => [cosine * first - sine * second, sine * first + cosine * second];
      for (const rows of [matrix, vectors]) {
        for (const row of rows) [row[p], row[q]] = turn(row[p], row[q]);
      }
      for (let i = 0; i < 3; i++) [matrix[p][i], matrix[q][i]] = turn(matrix[p][i], matrix[q][i]);
    }
  }
  return { values: [matrix[0][0], matrix[1][1], matrix[2][2]], vectors };
}

/** Solves the normal equations, of which the lower half is given, by Cholesky's decomposition; overwrites both. */
function solve(squares, right) {
  const at = (row, column) => TERMS * row + column;
  let sum = 0;
  for (let i = 0; i < TERMS; i++) sum += squares[at(i, i)];
  for (let column = 0; column < TERMS; column++) {
    squares[at(column, column)] += RIDGE * sum;
    for (let row = column; row < TERMS; row++) {
      let value = squares[at(row, column)];
      for (let i = 0; i < column; i++) value -= squares[at(row, i)] * squares[at(column, i)];
      // Rounding may leave less than the ridge.
      if (row === column) squares[at(row, row)] = Math.sqrt(Math.max(value, RIDGE * sum));
      else squares[at(row, column)] = value / squares[at(column, column)];
    }
  }
  for (let row = 0; row < TERMS; row++) {
    for (let i = 0; i < row; i++) right[row] -= squares[at(row, i)] * right[i];
    right[row] /= squares[at(row, row)];
  }
  for (let row = TERMS - 1; row >= 0; row--) {
    for (let i = row + 1; i < TERMS; i++) right[row] -= squares[at(i, row)] * right[i];
    right[row] /= squares[at(row, row)];
  }
  return right;
}
