"use strict";
/* Makes the plots of the report interactive. Without this script the drawings and tables of the page remain. */
(() => {
  const DASHES = [[7, 4], [2, 4], [9, 4, 2, 4], [14, 5]];
  const FONT = '12px system-ui, "Segoe UI", Roboto, "Liberation Sans", sans-serif';
  const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  // ---- Numbers: see pack.rs for the encoding. A gap becomes null, as uPlot wants it.
  function unpack(column) {
    const { kind, length } = column;
    if (kind === "even") return Array.from({ length }, (_, i) => column.first + column.step * i);
    if (kind === "constant") return new Array(length).fill(column.value);
    const bytes = atob(column.codes), step = (column.high - column.low) / 16777214;
    // A packed value is good to half a step: rounding to that many decimals gives back 0 for 0.
    const power = 10 ** Math.min(15, Math.max(0, Math.floor(-Math.log10(step || 1))));
    return Array.from({ length }, (_, i) => {
      const code = bytes.charCodeAt(3 * i) | bytes.charCodeAt(3 * i + 1) << 8 | bytes.charCodeAt(3 * i + 2) << 16;
      return code === 16777215 ? null : Math.round((column.low + code * step) * power) / power + 0;
    });
  }

  /* Decimals that show one part in ten thousand of a range. */
  const decimals = range => Math.min(9, Math.max(0, Math.floor(4 - Math.log10(range || 1))));

  function tickTexts(_plot, ticks, _axis, _space, step) {
    let digits = 0;
    while (digits < 12 && Math.abs(step * 10 ** digits - Math.round(step * 10 ** digits)) > 1e-6) digits++;
    return ticks.map(tick => tick === null ? "" : (tick + 0).toFixed(digits).replace(/^-(0(\.0*)?)$/, "$1"));
  }

  // ---- One panel.
  function seriesOf(panel) {
    const curves = panel.curves.map(curve => ({
      label: curve.label,
      stroke: () => css("--" + curve.role),
      width: { limit: 1, model: 2 }[curve.role] ?? 1.5,
      dash: curve.dash === null ? undefined : DASHES[curve.dash],
      spanGaps: false,
    }));
    const edge = { stroke: "transparent", points: { show: false } };
    return [{}, ...(panel.band ? [{ ...edge }, { ...edge }] : []), ...curves];
  }

  /* Index of the first curve: the edges of the band come before it, so that the band lies behind the curves. */
  const firstCurve = panel => panel.band ? 3 : 1;

  function dataOf(panel) {
    const band = panel.band ? [panel.band.high, panel.band.low] : [];
    return [panel.x, ...band, ...panel.curves.map(curve => curve.y)].map(unpack);
  }

  /* Shades the contact behind the curves. */
  function contactPlugin(contact) {
    const drawClear = plot => {
      if (!contact) return;
      const { left, top, width, height } = plot.bbox;
      const [from, to] = contact.map(t => Math.min(left + width, Math.max(left, plot.valToPos(t, "x", true))));
      plot.ctx.fillStyle = css("--contact");
      plot.ctx.fillRect(from, top, to - from, height);
    };
    return { hooks: { drawClear } };
  }

  /* Writes time, values and units under the cursor into the legend, where they cover no curve. */
  function readoutPlugin(panel, figure) {
    const time = figure.querySelector("output.time");
    const entries = [...figure.querySelectorAll(".entry output")];
    const show = (output, text) => { if (output) output.textContent = text; };
    const digits = { x: 0, y: 0 };
    const setDecimals = plot => {
      const values = plot.data.slice(1).flat().filter(value => value !== null);
      const span = column => column.reduce((most, v) => Math.max(most, v), -Infinity) - column.reduce((least, v) => Math.min(least, v), Infinity);
      digits.x = decimals(span(plot.data[0]));
      digits.y = decimals(span(values));
      for (const output of [time, ...entries]) output.hidden = false;
    };
    const setCursor = plot => {
      const row = plot.cursor.idx;
      const at = (column, unit) => {
        const value = plot.data[column][row];
        return value === null || value === undefined ? "–" : value.toFixed(column === 0 ? digits.x : digits.y) + " " + unit;
      };
      const none = row === null || row === undefined;
      show(time, none ? "" : at(0, panel.x_unit));
      panel.curves.forEach((_, i) => show(entries[i], none ? "" : at(i + firstCurve(panel), panel.unit)));
      if (panel.band) show(entries[panel.curves.length], none ? "" : at(2, "") + "to " + at(1, panel.unit));
    };
    return { hooks: { ready: setDecimals, setCursor } };
  }

  function options(panel, figure, group, withLabel) {
    const axis = { stroke: () => css("--soft"), font: FONT, labelFont: FONT, labelSize: 20, labelGap: 0,
      values: tickTexts, grid: { stroke: () => css("--grid"), width: 1 }, ticks: { show: false }, gap: 6 };
    const fill = () => css("--measured") + Math.round(255 * Number(css("--band"))).toString(16).padStart(2, "0");
    return {
      width: figure.clientWidth, height: panel.height + (withLabel ? 20 : 0), padding: [8, 20, 0, 0],
      legend: { show: false },
      scales: { x: { time: false } },
      axes: [{ ...axis, size: 24, label: withLabel ? panel.x_label : undefined }, { ...axis, size: 66, space: 22 }],
      series: seriesOf(panel),
      bands: panel.band ? [{ series: [1, 2], fill }] : [],
      cursor: {
        sync: { key: group.key, scales: ["x", null] }, drag: { x: true, y: false }, y: false, points: { size: 7 },
        bind: { dblclick: () => () => { group.show(...group.extent); return null; } },
      },
      plugins: [contactPlugin(group.contact), readoutPlugin(panel, figure),
        { hooks: { setScale: (plot, name) => name === "x" && group.follow(plot) } }],
    };
  }

  // ---- One group: the plots follow each other in zoom and cursor.
  class Group {
    constructor(section, key) {
      this.key = key;
      this.section = section;
      Object.assign(this, JSON.parse(section.querySelector("script").textContent));
      this.figures = [...section.querySelectorAll("figure")];
      const data = this.panels.map(dataOf);
      const ends = data.flatMap(columns => [columns[0][0], columns[0][columns[0].length - 1]]).filter(Number.isFinite);
      this.extent = [Math.min(...ends), Math.max(...ends)];
      this.plots = [];
      this.plots = this.panels.map((panel, i) => this.build(panel, this.figures[i], data[i], i));
      section.classList.add("is-live");
      this.connect();
    }

    build(panel, figure, data, index) {
      const holder = document.createElement("div");
      holder.className = "live";
      holder.tabIndex = 0;
      holder.setAttribute("role", "img");
      holder.setAttribute("aria-label", `${this.title}: ${panel.y_label} over ${panel.x_label}. `
        + "Arrow keys pan, plus and minus zoom, 0 shows all, shift and arrow steps the cursor.");
      figure.append(holder);
      const next = this.panels[index + 1];
      const plot = new uPlot(options(panel, figure, this, !next || next.x_label !== panel.x_label), data, holder);
      holder.addEventListener("keydown", event => this.key_down(event, plot));
      figure.querySelectorAll(".entry").forEach((entry, i) => this.toggle(entry, plot, panel, i));
      return plot;
    }

    /* A name in the legend hides its curve; the last name is the band. */
    toggle(entry, plot, panel, index) {
      const series = index < panel.curves.length ? [index + firstCurve(panel)] : [1, 2];
      const act = () => {
        const on = !plot.series[series[0]].show;
        series.forEach(i => plot.setSeries(i, { show: on }));
        entry.setAttribute("aria-pressed", on);
      };
      Object.entries({ role: "button", tabindex: 0, "aria-pressed": true }).forEach(([k, v]) => entry.setAttribute(k, v));
      entry.addEventListener("click", act);
      entry.addEventListener("keydown", event => {
        if (event.key === "Enter" || event.key === " ") { event.preventDefault(); act(); }
      });
    }

    connect() {
      const buttons = this.section.querySelector(".buttons");
      const actions = {
        all: () => this.show(...this.extent),
        contact: () => this.show(...this.contact),
        csv: () => save(new Blob([this.csv()], { type: "text/csv" }), this.section.id + ".csv"),
        png: () => this.png(),
      };
      buttons.hidden = false;
      buttons.addEventListener("click", event => actions[event.target.dataset.do]?.());
      new ResizeObserver(() => this.plots.forEach((plot, i) => {
        const width = this.figures[i].clientWidth;
        if (width > 0 && width !== plot.width) plot.setSize({ width, height: plot.height });
      })).observe(this.section);
    }

    show(min, max) {
      this.plots.forEach(plot => plot.setScale("x", { min, max }));
    }

    /* Gives the range of one plot to the others. */
    follow(leader) {
      const { min, max } = leader.scales.x;
      for (const plot of this.plots) {
        const x = plot.scales.x;
        if (plot !== leader && (x.min !== min || x.max !== max)) plot.setScale("x", { min, max });
      }
    }

    key_down(event, plot) {
      const { min, max } = plot.scales.x, [first, last] = this.extent, width = max - min;
      const pan = part => {
        const by = Math.max(first - min, Math.min(last - max, part * width));
        this.show(min + by, max + by);
      };
      const zoom = factor => {
        const middle = plot.cursor.idx === null || plot.cursor.idx === undefined ? (min + max) / 2 : plot.data[0][plot.cursor.idx];
        this.show(Math.max(first, middle - (middle - min) * factor), Math.min(last, middle + (max - middle) * factor));
      };
      const actions = {
        ArrowLeft: () => event.shiftKey ? this.step(plot, -1) : pan(-0.1),
        ArrowRight: () => event.shiftKey ? this.step(plot, 1) : pan(0.1),
        "+": () => zoom(1 / 1.5), "=": () => zoom(1 / 1.5), "-": () => zoom(1.5), "0": () => this.show(first, last),
      };
      const act = actions[event.key];
      if (act && !event.ctrlKey && !event.metaKey && !event.altKey) { event.preventDefault(); act(); }
    }

    /* Moves the cursor by whole samples. */
    step(plot, by) {
      const x = plot.data[0], { min, max } = plot.scales.x;
      const from = plot.cursor.idx ?? plot.valToIdx((min + max) / 2);
      const at = x[Math.max(0, Math.min(x.length - 1, from + by))];
      if (at < min || at > max) this.show(min + by * (max - min) / 2, max + by * (max - min) / 2);
      for (const other of this.plots) other.setCursor({ left: other.valToPos(at, "x"), top: other.bbox.height / 2 / devicePixelRatio });
    }

    /* All curves of the group over one abscissa; an empty cell where a panel has no sample. */
    csv() {
      const quote = text => '"' + text.replaceAll('"', '""') + '"';
      const head = [this.panels[0].x_label], rows = new Map();
      let width = 1;
      this.plots.forEach((plot, p) => {
        const { curves, band, y_label } = this.panels[p];
        const names = [...(band ? [band.label + ", high", band.label + ", low"] : []), ...curves.map(curve => curve.label)];
        head.push(...names.map(name => `${y_label}: ${name}`));
        plot.data[0].forEach((x, i) => {
          const key = Number(x.toPrecision(9));
          if (!rows.has(key)) rows.set(key, []);
          plot.data.slice(1).forEach((column, c) => { rows.get(key)[width + c] = column[i]; });
        });
        width += names.length;
      });
      const text = value => value === null || value === undefined ? "" : String(Number(value.toPrecision(7)));
      const line = ([x, cells]) => [x, ...Array.from({ length: width - 1 }, (_, i) => text(cells[i + 1]))].join(",");
      return [head.map(quote).join(","), ...[...rows].sort((a, b) => a[0] - b[0]).map(line)].join("\r\n") + "\r\n";
    }

    /* The plots as they are, below each other, with title and legend. */
    png() {
      const ratio = devicePixelRatio, head = 22 * ratio;
      const canvases = this.plots.map(plot => plot.ctx.canvas);
      const sheet = document.createElement("canvas"), ink = sheet.getContext("2d");
      sheet.width = Math.max(...canvases.map(canvas => canvas.width));
      sheet.height = head + canvases.reduce((sum, canvas) => sum + canvas.height + head, 0);
      ink.fillStyle = css("--bg");
      ink.fillRect(0, 0, sheet.width, sheet.height);
      ink.font = `${13 * ratio}px sans-serif`;
      ink.fillStyle = css("--fg");
      ink.fillText(this.title, 8 * ratio, 0.75 * head);
      let top = head;
      canvases.forEach((canvas, p) => {
        const { y_label, curves, band } = this.panels[p];
        let left = 8 * ratio;
        const write = (text, colour) => {
          ink.fillStyle = colour;
          ink.fillText(text, left, top + 0.75 * head);
          left += ink.measureText(text).width + 16 * ratio;
        };
        write(y_label, css("--fg"));
        const { series } = this.plots[p], first = firstCurve(this.panels[p]);
        curves.forEach((curve, i) => series[first + i].show && write(curve.label, css("--" + curve.role)));
        if (band && series[1].show) write(band.label, css("--soft"));
        ink.drawImage(canvas, 0, top + head);
        top += head + canvas.height;
      });
      sheet.toBlob(blob => save(blob, this.section.id + ".png"));
    }
  }

  function save(blob, name) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  function connectCopy() {
    const button = document.getElementById("copy"), code = document.getElementById("command");
    button.hidden = false;
    button.addEventListener("click", () => {
      getSelection().selectAllChildren(code); // Where the clipboard is not allowed, the selection remains.
      navigator.clipboard?.writeText(code.textContent).then(() => { button.textContent = "copied"; }, () => {});
    });
  }

  connectCopy();
  const groups = [...document.querySelectorAll(".group")].map((section, i) => new Group(section, "group-" + i));
  document.querySelectorAll(".live-only").forEach(note => { note.hidden = false; });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () =>
    groups.forEach(group => group.plots.forEach(plot => plot.redraw(false))));
})();
