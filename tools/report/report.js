'use strict';
// Draws every figure.chart from the JSON inside it (charts.cc writes it).
(() => {
  const colour = (name) =>
      getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const palette = () => [1, 2, 3, 4].map((i) => colour('--series-' + i));

  // dygraphs' rows: x, then for each series its value, or low, value, high if any has a band.
  function rowsOf(spec) {
    const bands = spec.series.some((s) => s.band);
    return spec.x.map((x, i) => [x].concat(spec.series.map((s) => {
      const y = s.y[i];
      if (!bands) return y;
      if (y === null) return [null, null, null];
      const half = s.band ? s.band[i] : 0;
      return [y - half, y, y + half];
    })));
  }

  function drawMarks(marks) {
    return (context, area, graph) => {
      context.save();
      context.strokeStyle = context.fillStyle = colour('--faint');
      context.setLineDash([4, 3]);
      context.font = '12px sans-serif';
      const middle = marks.reduce((sum, mark) => sum + mark.x, 0) / marks.length;
      marks.forEach((mark, i) => {
        const x = Math.round(graph.toDomXCoord(mark.x)) + 0.5;
        if (x < area.x || x > area.x + area.w) return;
        context.beginPath();
        context.moveTo(x, area.y);
        context.lineTo(x, area.y + area.h);
        context.stroke();
        // Labels point away from the other marks, and stay inside.
        const share = (x - area.x) / area.w;
        const left = share > 0.7 || (mark.x < middle && share > 0.3);
        context.textAlign = left ? 'right' : 'left';
        context.fillText(mark.text, x + (left ? -5 : 5), area.y + 14 + 16 * i);
      });
      context.restore();
    };
  }

  const colours = () => ({
    colors: palette(), axisLineColor: colour('--faint'), gridLineColor: colour('--rule')});

  const groups = new Map();
  const graphs = [];
  for (const figure of document.querySelectorAll('figure.chart')) {
    const spec = JSON.parse(figure.querySelector('script').textContent);
    const series = {};
    for (const s of spec.series) {
      series[s.name] = s.points
          ? {strokeWidth: 0, strokePattern: [3, 4], drawPoints: true, pointSize: 2.2,
             highlightCircleSize: 4}
          : {strokeWidth: s.dashed ? 1.5 : 1.8, strokePattern: s.dashed ? [6, 4] : null};
    }
    const graph = new Dygraph(figure.querySelector('.plot'), rowsOf(spec), Object.assign({
      labels: ['x'].concat(spec.series.map((s) => s.name)),
      customBars: spec.series.some((s) => s.band),
      fillAlpha: 0.22,
      series,
      xlabel: spec.xLabel,
      ylabel: spec.yLabel,
      xLabelHeight: 16,
      yLabelWidth: 16,
      valueRange: spec.yRange || null,
      logscale: spec.logY,
      connectSeparatedPoints: true,
      legend: 'always',
      labelsDiv: figure.querySelector('.legend'),
      axisLabelFontSize: 12,
      axes: {x: {pixelsPerLabel: 45, valueFormatter: (x) => x.toPrecision(6) + ' '},
             y: {axisLabelWidth: 58, pixelsPerLabel: 26, valueFormatter: (y) => y.toPrecision(5)}},
      digitsAfterDecimal: 4,
      underlayCallback: drawMarks(spec.marks),
    }, colours()));
    graphs.push(graph);
    if (spec.group) groups.set(spec.group, (groups.get(spec.group) || []).concat(graph));
  }
  for (const group of groups.values()) {
    if (group.length > 1) Dygraph.synchronize(group, {range: false});
  }

  const recolour = () => graphs.forEach((graph) => graph.updateOptions(colours()));
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', recolour);
  const printing = (on) => () => {
    document.documentElement.classList.toggle('print', on);
    recolour();  // dygraphs follows the width by itself; resize() here leaves blank canvases
  };
  addEventListener('beforeprint', printing(true));
  addEventListener('afterprint', printing(false));
  document.documentElement.dataset.charts = graphs.length;
})();
