// Copies a text, and works out the inertia about another point: J_P = R'(J + m(d.d 1 - d d'))R, d = c - P.
document.querySelectorAll("button.take").forEach(button => button.addEventListener("click", async () => {
  const text = button.nextElementSibling;
  try { await navigator.clipboard.writeText(text.textContent); }
  catch { getSelection().selectAllChildren(text); document.execCommand("copy"); }
  button.textContent = "Copied";
}));
document.querySelectorAll(".elsewhere form").forEach(form => {
  const {values, covariance} = JSON.parse(form.dataset.numbers);
  const about = (v, point, R) => {
    const d = [0, 1, 2].map(i => v[1 + i] - point[i]), dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    const J = [[4, 5, 6], [5, 7, 8], [6, 8, 9]].map((row, i) => row.map((k, j) => v[k] + v[0] * ((i === j) * dd - d[i] * d[j])));
    return R.map((_, a) => R.map((_, b) => {
      let sum = 0;
      for (let i = 0; i < 3; i++) for (let j = 0; j < 3; j++) sum += R[i][a] * J[i][j] * R[j][b];
      return sum;
    })).flat();
  };
  const show = () => {
    const number = name => Number(form.elements[name].value) || 0;
    const point = ["x", "y", "z"].map(number);
    const [r, p, y] = ["roll", "pitch", "yaw"].map(name => number(name) * Math.PI / 180);
    const [cr, sr, cp, sp, cy, sy] = [Math.cos(r), Math.sin(r), Math.cos(p), Math.sin(p), Math.cos(y), Math.sin(y)];
    const R = [[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
      [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr], [-sp, cp * sr, cp * cr]];
    const value = about(values, point, R);
    // Linear in mass and inertia, quadratic in the centre of mass: central differences are exact.
    const slopes = values.map((_, k) => {
      const h = 1e-3, [up, down] = [h, -h].map(step => about(values.map((v, i) => i === k ? v + step : v), point, R));
      return up.map((u, e) => (u - down[e]) / (2 * h));
    });
    form.nextElementSibling.querySelectorAll(":scope > div").forEach((cell, e) => {
      let variance = 0;
      slopes.forEach((a, i) => slopes.forEach((b, j) => { variance += a[e] * covariance[i][j] * b[e]; }));
      const half = 1.959964 * Math.sqrt(Math.max(variance, 0));
      const places = half > 0 ? Math.min(Math.max(1 - Math.floor(Math.log10(half)), 0), 9) : 3;
      cell.querySelector("b").textContent = value[e].toFixed(places).replace("-", "−");
      cell.querySelector(".pm").textContent = "± " + half.toFixed(places);
    });
  };
  form.addEventListener("input", show);
});
