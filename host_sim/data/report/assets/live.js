// Makes charts of the data that stand in the page. Without this script the page shows pictures of the same data.
(function () {
  'use strict';
  const root = document.documentElement;
  const colour = name => getComputedStyle(root).getPropertyValue('--' + name).trim();

  function add(parent, tag, properties) {
    return parent.appendChild(Object.assign(document.createElement(tag), properties));
  }

  // A number that a person can read.
  function number(value, digits) {
    if (value === null || value === undefined || Number.isNaN(value)) return '-';
    const size = Math.abs(value);
    if (size !== 0 && (size >= 1e6 || size < 1e-4)) return value.toExponential(2);
    return String(Number(value.toPrecision(digits)));
  }
  const text = value => number(value, 4);

  // "torque / N m" -> ["torque", "N m"].
  function label(words) {
    const cut = words.lastIndexOf(' / ');
    return cut < 0 ? [words, ''] : [words.slice(0, cut), words.slice(cut + 3)];
  }

  // The first series minus each other one. Without the first series.
  function differences(rows) {
    return rows.map(row => [row[0]].concat(row.slice(2).map(v => v === null || row[1] === null ? null : row[1] - v)));
  }

  // The row whose x is nearest.
  function nearest(rows, x) {
    let low = 0, high = rows.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (rows[middle][0] < x) low = middle; else high = middle;
    }
    return Math.abs(rows[low][0] - x) <= Math.abs(rows[high][0] - x) ? low : high;
  }

  function button(parent, words, pressed, onclick) {
    const b = add(parent, 'button', {type: 'button', textContent: words, onclick});
    if (pressed !== null) b.setAttribute('aria-pressed', pressed);
    return b;
  }

  function swatch(parent, series) {
    const line = document.createElement('i');
    line.className = series.dashed ? 'swatch dashed' : 'swatch';
    line.style.borderColor = 'var(--c' + series.colour + ')';
    parent.prepend(line);
  }

  // The charts of one figure. They share the window of x, the place of the pointer, and what is shown.
  class Charts {
    constructor(source, first) {
      const data = JSON.parse(source.textContent);
      this.panels = data.panels;
      this.difference = data.difference;
      this.asDifference = false;
      this.hidden = new Set();
      this.window = null;
      this.box = document.createElement('div');
      this.box.className = 'live';
      source.after(this.box);
      this.makeTools(first);
      for (const panel of this.panels) this.makePanel(panel);
      this.draw();
    }

    makeTools(hint) {
      const tools = add(this.box, 'div', {className: 'tools'});
      this.lines = [];
      if (this.panels.length > 1) {
        add(tools, 'span', {textContent: 'show'});
        for (const panel of this.panels)
          panel.button = button(tools, panel.name, panel.shown, () => { panel.shown = !panel.shown; this.draw(); });
        button(tools, 'all', null, () => { for (const panel of this.panels) panel.shown = true; this.draw(); });
      }
      for (const series of this.panels.length > 1 || this.difference ? this.panels[0].series : []) {
        const b = button(tools, series.name, true, () => {
          if (!this.hidden.delete(series.name)) this.hidden.add(series.name);
          this.draw();
        });
        swatch(b, series);
        this.lines.push({name: series.name, button: b});
      }
      if (this.difference) {
        this.switch = button(tools, this.difference, false, () => { this.asDifference = !this.asDifference; this.draw(true); });
        this.switch.className = 'difference';
      }
      this.whole = button(tools, 'whole range', null, () => this.zoom(null));
      this.whole.className = 'whole';
      if (hint) add(tools, 'span', {textContent: 'Drag to zoom, shift and drag to move, double click for the whole range.'});
    }

    makePanel(panel) {
      panel.box = add(this.box, 'div', {className: 'panel'});
      panel.head = add(panel.box, 'div', {className: 'head'});
      panel.chart = add(panel.box, 'div', {className: 'chart'});
    }

    seriesOf(panel) { return this.asDifference ? panel.series.slice(1) : panel.series; }
    rowsOf(panel) {
      if (!this.asDifference) return panel.rows;
      return panel.left = panel.left || differences(panel.rows);
    }

    // What stands above a chart: its name, and each series with its value at the pointer.
    showValues(panel, row) {
      panel.head.textContent = '';
      const [x, xUnit] = label(panel.x), [y, yUnit] = label(panel.y), values = row === null ? null : this.rowsOf(panel)[row];
      add(panel.head, 'b', {textContent: panel.title || panel.name});
      this.seriesOf(panel).forEach((series, k) => {
        if (this.hidden.has(series.name)) return;
        const value = values ? ' ' + text(values[k + 1]) : '';
        swatch(add(panel.head, 'span', {className: 'value', textContent: series.name + value}), series);
      });
      const what = (this.asDifference ? this.difference : y) + (yUnit ? ' in ' + yUnit : '');
      const at = values ? ', at ' + x + ' ' + number(values[0], 6) + ' ' + xUnit : ' over ' + x + (xUnit ? ' in ' + xUnit : '');
      add(panel.head, 'span', {className: 'unit', textContent: what + at});
    }

    options(panel) {
      const series = this.seriesOf(panel), own = {};
      series.forEach((s, k) => { own['s' + k] = {strokePattern: s.dashed ? [6, 3] : null}; });
      return {
        labels: ['x'].concat(series.map((s, k) => 's' + k)),
        series: own,
        colors: series.map(s => colour('c' + s.colour)),
        visibility: series.map(s => !this.hidden.has(s.name)),
        legend: 'never',
        strokeWidth: 1.3,
        highlightCircleSize: 3,
        gridLineColor: colour('rule'),
        axisLineColor: colour('soft'),
        gridLineWidth: 0.6,
        logscale: panel.logy && !this.asDifference,
        axes: {
          x: {logscale: panel.logx, axisLabelFormatter: text, valueFormatter: text, pixelsPerLabel: 70},
          y: {axisLabelFormatter: text, valueFormatter: text, axisLabelWidth: 62, pixelsPerLabel: 36},
        },
        dateWindow: this.window,
        animatedZooms: false,
        xRangePad: panel.logx ? 0 : 2,
        yRangePad: 4,
        underlayCallback: (canvas, area, g) => this.shade(panel, canvas, area, g),
        highlightCallback: (event, x) => this.point(x),
        unhighlightCallback: () => this.point(null),
        drawCallback: (g, first) => { if (!first) this.follow(g); },
      };
    }

    shade(panel, canvas, area, g) {
      for (const shade of panel.shades) {
        const right = area.x + area.w, left = area.x + area.w * Math.max(g.toPercentXCoord(shade.from), 0);
        if (left >= right) continue;
        canvas.save();
        canvas.globalAlpha = 0.14;
        canvas.fillStyle = colour('soft');
        canvas.fillRect(left, area.y, right - left, area.h);
        canvas.globalAlpha = 1;
        canvas.font = '12px sans-serif';
        canvas.textAlign = 'right';
        canvas.fillText(shade.text, right - 6, area.y + 14);
        canvas.restore();
      }
    }

    // Draws every panel that is shown. anew: its series have changed.
    draw(anew) {
      for (const panel of this.panels) {
        panel.box.hidden = !panel.shown;
        if (panel.button) panel.button.setAttribute('aria-pressed', panel.shown);
        if (anew && panel.graph) { panel.graph.destroy(); panel.graph = null; }
        if (!panel.shown) continue;
        this.silently(() => {
          if (panel.graph) { panel.graph.updateOptions(this.options(panel)); panel.graph.resize(); }
          else panel.graph = new Dygraph(panel.chart, this.rowsOf(panel), this.options(panel));
        });
        this.showValues(panel, null);
      }
      this.whole.hidden = this.window === null;
      for (const line of this.lines) line.button.setAttribute('aria-pressed', !this.hidden.has(line.name));
      if (this.switch) {
        this.switch.setAttribute('aria-pressed', this.asDifference);
        if (this.lines.length > 0) this.lines[0].button.disabled = this.asDifference;
      }
    }

    // Charts are drawn without telling the others.
    silently(work) {
      const before = this.quiet;
      this.quiet = true;
      work();
      this.quiet = before;
    }

    // One chart was zoomed or moved: the others follow.
    follow(graph) {
      if (this.quiet) return;
      this.zoom(graph.isZoomed('x') ? graph.xAxisRange() : null);
    }

    zoom(window) {
      this.window = window;
      this.whole.hidden = window === null;
      this.silently(() => {
        for (const panel of this.panels)
          if (panel.graph && panel.shown) panel.graph.updateOptions({dateWindow: window, valueRange: null});
      });
    }

    point(x) {
      for (const panel of this.panels) {
        if (!panel.graph || !panel.shown) continue;
        const row = x === null ? null : nearest(this.rowsOf(panel), x);
        if (row === null) panel.graph.clearSelection(); else panel.graph.setSelection(row);
        this.showValues(panel, row);
      }
    }
  }

  const all = Array.from(document.querySelectorAll('script.charts')).map((source, k) => new Charts(source, k === 0));
  root.classList.add('charts-live');
  for (const charts of all) charts.draw();  // now that the pictures are gone and the widths are known
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => all.forEach(charts => charts.draw(true)));
  for (const fold of document.querySelectorAll('details'))
    fold.addEventListener('toggle', () => { if (fold.open) all.forEach(charts => charts.draw()); });
})();
