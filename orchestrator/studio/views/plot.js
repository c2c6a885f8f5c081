// Curves over time, drawn by the ECharts that NiceGUI brings. The page never holds more than what is in sight: each time
// the view has moved, the server is asked for the visible part, one question at a time.
import { echarts } from "nicegui-echart";
import { selectByDragging } from "misfit-views";

const KINDS = ["measured", "modelled", "residual", "chosen"];
const KEY_STEP = 0.1; // of what is in sight
const KEY_ZOOM = 0.7;

export default {
  template: `<div tabindex="0" class="view-plot">
    <div ref="canvas" class="view-canvas"></div><div ref="band" class="view-band"></div></div>`,
  props: { options: Object, source: String, selecting: Boolean, selected: Array },
  async mounted() {
    await new Promise((resolve) => setTimeout(resolve, 0)); // until the style sheet gives the element its size
    this.asking = false;
    this.stale = false;
    this.trials = [];
    this.chart = echarts.init(this.$refs.canvas);
    const { lines, ...shown } = this.options;
    this.chart.setOption(shown);
    this.chart.on("datazoom", () => this.ask());
    this.listen();
    this.resizes = new ResizeObserver(() => {
      this.chart.resize();
      this.ask();
    });
    this.resizes.observe(this.$el);
    this.ask();
  },
  beforeUnmount() {
    this.resizes?.disconnect();
    this.chart?.dispose();
  },
  watch: {
    selected() {
      this.mark();
    },
  },
  methods: {
    visible() {
      const zoom = this.chart.getOption().dataZoom[0];
      return [zoom.startValue, zoom.endValue];
    },
    async ask() {
      this.stale = this.asking;
      if (this.asking) return;
      this.asking = true;
      const [low, high] = this.visible();
      const columns = Math.min(4000, Math.max(100, Math.round(this.chart.getWidth())));
      const answer = await fetch(`${this.source}?${new URLSearchParams({ low, high, columns })}`);
      if (answer.ok && !this.chart.isDisposed()) this.receive(unpacked(await answer.arrayBuffer()));
      this.asking = false;
      if (this.stale) this.ask();
    },
    change(options) {
      const { lines, dataZoom, ...shown } = options; // what is in sight stays
      this.chart.setOption(shown);
      this.mark();
      this.ask();
    },
    whole() {
      this.chart.dispatchAction({ type: "dataZoom", start: 0, end: 100 });
    },
    receive(view) {
      const old = new Set(this.trials);
      this.trials = view.trials.map((trial) => trial.place);
      for (const place of this.trials) old.delete(place);
      const series = view.trials.flatMap((trial) => this.lines(trial, view.from));
      for (const place of old) for (const kind of KINDS) series.push({ ...this.line(kind, place), data: [] });
      const [values, residuals] = [view.values, view.residuals];
      this.chart.setOption({
        yAxis: [nice(...values), nice(...residuals)].map(([min, max]) => ({ min, max })),
        series,
      });
    },
    lines(trial, from) {
      const chosen = trial.residual.map((value, k) => (trial.flags[k] ? value : NaN));
      return KINDS.map((kind) => ({
        ...this.line(kind, trial.place),
        data: pairs(trial.time, { ...trial, chosen }[kind], from),
      }));
    },
    line(kind, place) {
      const below = kind === "residual" || kind === "chosen" ? 1 : 0;
      return { ...this.options.lines[kind], id: `${kind}-${place}`, xAxisIndex: below, yAxisIndex: below };
    },
    mark() {
      const [from, to] = this.selected ?? [];
      const data = from === undefined ? [] : [[{ xAxis: from }, { xAxis: to }]];
      this.chart?.setOption({ series: ["above", "below"].map((id) => ({ id, markArea: { data } })) });
    },
    zoom(from, to) {
      this.chart.dispatchAction({ type: "dataZoom", startValue: from, endValue: to });
    },
    listen() {
      this.$el.addEventListener("keydown", (event) => this.key(event));
      const wanted = (event) => this.selecting || event.shiftKey;
      selectByDragging(this.$refs.canvas, this.$refs.band, false, wanted, (...corners) => this.brush(...corners));
    },
    brush(...corners) {
      const [from, to] = corners.map((corner) => this.chart.convertFromPixel({ gridIndex: 0 }, corner)[0]);
      this.$emit("brush", { from, to });
    },
    key(event) {
      const [from, to] = this.visible();
      const [step, middle] = [KEY_STEP * (to - from), 0.5 * (from + to)];
      const zoomed = (factor) => this.zoom(middle - 0.5 * factor * (to - from), middle + 0.5 * factor * (to - from));
      const moves = {
        ArrowLeft: () => this.zoom(from - step, to - step),
        ArrowRight: () => this.zoom(from + step, to + step),
        "+": () => zoomed(KEY_ZOOM),
        "-": () => zoomed(1 / KEY_ZOOM),
        Home: () => this.whole(),
        Escape: () => this.$emit("brush", null),
      };
      if (event.ctrlKey || event.metaKey || !moves[event.key]) return;
      event.preventDefault();
      moves[event.key]();
    },
  },
};

// What `window.packed` wrote.
function unpacked(buffer) {
  const length = new Uint32Array(buffer, 0, 1)[0];
  const view = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  let at = 4 + length;
  for (const trial of view.trials) {
    for (const kind of ["time", "measured", "modelled", "residual"]) {
      trial[kind] = new Float32Array(buffer, at, trial.count);
      at += 4 * trial.count;
    }
    trial.flags = new Uint8Array(buffer, at, trial.count);
    at += 4 * Math.ceil(trial.count / 4);
  }
  return view;
}

function pairs(time, values, from) {
  const found = new Float64Array(2 * time.length);
  for (let k = 0; k < time.length; k++) {
    found[2 * k] = from + time[k];
    found[2 * k + 1] = values[k];
  }
  return found;
}

// Ends of an axis that holds low to high: multiples of a twentieth of the power of ten above the span.
function nice(low, high) {
  const unit = 10 ** Math.ceil(Math.log10(high - low)) / 20;
  return [Math.floor(low / unit) * unit, Math.ceil(high / unit) * unit];
}
