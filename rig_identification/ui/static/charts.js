// Readings of a simulated run on one time axis: drag to zoom, double-click for the whole.
(() => {
  const box = document.querySelector("#charts");
  const runs = JSON.parse(document.querySelector("#series").textContent);
  const colour = name => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  const run = box.querySelector("select"), place = box.querySelector(".plots");
  const strokes = ["accent", "fair", "good"];
  let plots = [];
  const draw = () => {
    plots.forEach(p => p.destroy());
    const axis = {stroke: colour("muted"), grid: {stroke: colour("line"), width: 1}, ticks: {stroke: colour("line"), width: 1}};
    plots = runs[run.value].map(c => new uPlot({
      title: c.label, width: place.clientWidth, height: 160,
      cursor: {sync: {key: "time"}, drag: {x: true, y: false}, y: false},
      scales: {x: {time: false}},
      axes: [{...axis, size: 34}, {...axis, size: 64, label: c.unit, labelSize: 18}],
      series: [{label: "s", value: (_, v) => v == null ? "–" : v.toFixed(3)},
        ...c.lines.map((label, i) => ({label, stroke: colour(strokes[i]), width: 1, points: {show: false}, value: (_, v) => v == null ? "–" : v.toPrecision(5)}))],
    }, [c.time, ...c.values], place));
  };
  run.addEventListener("change", draw);
  new ResizeObserver(() => plots.forEach(p => p.width !== place.clientWidth && p.setSize({width: place.clientWidth, height: p.height}))).observe(place);
  draw();
})();
