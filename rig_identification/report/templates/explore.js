// All channels of a recording on one time axis: drag to zoom, double-click for the whole, hover to read.
(() => {
  const box = document.querySelector("#explore");
  if (!box) return;
  const runs = JSON.parse(document.querySelector("#samples").textContent);
  const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer;
  const numbers = q => Array.from(new Uint16Array(bytes(q.steps)), n => q.low + (q.high - q.low) * n / 65535);
  const colour = name => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  const [run, what] = box.querySelectorAll("select"), place = box.querySelector(".plots");
  let plots = [], busy = false;
  const together = (u, key) => {
    if (key !== "x" || busy) return;
    busy = true;
    plots.forEach(p => p !== u && p.setScale("x", {min: u.scales.x.min, max: u.scales.x.max}));
    busy = false;
  };
  const draw = () => {
    plots.forEach(p => p.destroy());
    plots = [];
    const sync = uPlot.sync("time"), channels = runs[run.value];
    channels.forEach((c, place_) => {
      const time = Array.from(new Float32Array(bytes(c.time))), measured = numbers(c.measured), predicted = numbers(c.predicted);
      const residual = what.value === "residual", last = place_ === channels.length - 1;
      const axis = {stroke: colour("muted"), grid: {stroke: colour("line"), width: 1}, ticks: {stroke: colour("line"), width: 1}};
      const line = (label, name, width) => ({label, stroke: colour(name), width, points: {show: false},
        value: (_, v) => v == null ? "–" : v.toPrecision(5)});
      plots.push(new uPlot({
        title: c.label, width: place.clientWidth, height: last ? 170 : 150,
        cursor: {sync: {key: sync.key}, drag: {x: true, y: false}, y: false},
        scales: {x: {time: false}},
        axes: [{...axis, size: 34, label: last ? "s" : "", labelSize: last ? 18 : 0}, {...axis, size: 64, label: residual ? "σ" : c.unit, labelSize: 18}],
        series: [{label: "s", value: (_, v) => v == null ? "–" : v.toFixed(3)},
          ...(residual ? [line("residual", "residual", 1)] : [line("measured", "measured", 2), line("predicted", "accent", 1)])],
        hooks: {setScale: [together]},
      }, residual ? [time, measured.map((m, i) => (m - predicted[i]) / c.noise)] : [time, measured, predicted], place));
    });
    box.querySelector(".extremes").hidden = channels.every(c => c.all);
  };
  box.addEventListener("toggle", () => { if (box.open && !plots.length) draw(); });
  run.addEventListener("change", draw);
  what.addEventListener("change", draw);
  new ResizeObserver(() => plots.forEach(p => p.width !== place.clientWidth && p.setSize({width: place.clientWidth, height: p.height}))).observe(place);
  box.plots = () => plots;
})();
