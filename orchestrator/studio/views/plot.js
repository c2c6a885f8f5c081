// Curves over time, drawn by the ECharts that NiceGUI brings. The page never holds more than what is in sight: each time
// the view has moved, the server is asked for the visible part, one question at a time.
import { echarts } from "nicegui-echart";
import { selectByDragging } from "misfit-views";

const KINDS = ["measured", "modelled", "residual", "chosen"];
// While the view moves, fewer columns are asked for, not more often than this, and all of them once it has rested.
const MOVING_COLUMNS = 300;
const MOVING_MS = 50;
const REST_MS = 160;
const KEY_STEP = 0.1; // of what is in sight
const KEY_ZOOM = 0.7;

export default {
  template: `<div tabindex="0" class="view-plot">
    <div ref="canvas" class="view-canvas"></div><div ref="band" class="view-band"></div></div>`,
  props: { options: Object, source: String, selecting: Boolean, selected: Array },
  async mounted() {
    await new Promise((resolve) => setTimeout(resolve, 0)); // until the style sheet gives the element its size
    this.asking = false;
    this.trials = [];
    this.chart = echarts.init(this.$refs.canvas);
    const { lines, ...shown } = this.options;
    this.chart.setOption(shown);
    this.mark();
    this.chart.on("datazoom", () => this.move());
    this.listen();
    // Also called once at the beginning, when the element has its size.
    this.resizes = new ResizeObserver(() => {
      this.chart.resize();
      if (this.$el.clientWidth) this.ask();
    });
    this.resizes.observe(this.$el);
  },
  beforeUnmount() {
    clearTimeout(this.resting);
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
    move() {
      clearTimeout(this.resting);
      this.resting = setTimeout(() => this.ask(), REST_MS);
      this.ask(MOVING_COLUMNS);
    },
    async ask(most = 4000) {
      this.next = most; // what is to be asked once the present answer is here
      if (this.asking) return;
      this.asking = true;
      try {
        while (this.next) await this.look();
      } catch (error) {
        console.warn("curves could not be fetched; the next move asks again:", error.message);
      } finally {
        this.asking = false;
      }
    },
    async look() {
      if (this.next === MOVING_COLUMNS) await new Promise((resolve) => setTimeout(resolve, MOVING_MS));
      const most = this.next;
      this.next = null;
      if (this.chart.isDisposed()) return;
      const columns = Math.min(most, Math.max(100, Math.round(this.chart.getWidth())));
      const [low, high] = this.visible();
      const answer = await fetch(`${this.source}?${new URLSearchParams({ low, high, columns })}`);
      if (!answer.ok) throw new Error(await answer.text());
      const content = await answer.arrayBuffer();
      if (!this.chart.isDisposed()) this.receive(unpacked(content));
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
      for (const place of old) for (const kind of KINDS) series.push(this.line(kind, place));
      const [values, residuals] = [view.values, view.residuals];
      const yAxis = [nice(...values), nice(...residuals)].map(([min, max]) => ({ min, max }));
      this.chart.setOption({ yAxis, series }, { lazyUpdate: true });
    },
    lines(trial, from) {
      const marked = trial.flags.some((flag) => flag);
      const chosen = marked ? trial.residual.map((value, k) => (trial.flags[k] ? value : NaN)) : [];
      const values = { ...trial, chosen };
      return KINDS.map((kind) => this.line(kind, trial.place, outline(trial, from, values[kind], this.options.lines[kind])));
    },
    line(kind, place, renderItem = () => null) {
      const below = kind === "residual" || kind === "chosen" ? 1 : 0;
      const fixed = { type: "custom", silent: true, animation: false, clip: true, data: [[0, 0]] };
      return { ...fixed, id: `${kind}-${place}`, xAxisIndex: below, yAxisIndex: below, renderItem };
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

// What draws one line. Where points are pairs of extremes, it is the band between them, as wide as a line at least:
// filling it is far cheaper than stroking to and fro between them, and shows the same.
function outline(trial, from, values, { color, width, opacity }) {
  return (params, api) => {
    const [left, bottom] = api.coord([from, 0]);
    const [right, top] = api.coord([from + 1, 1]);
    const at = (k, aside) => [left + trial.time[k] * (right - left), bottom + values[k] * (top - bottom) + aside];
    const line = { fill: "none", stroke: color, lineWidth: width, lineJoin: "bevel", opacity };
    const [type, style] = trial.paired ? ["polygon", { fill: color, opacity }] : ["polyline", line];
    const shapes = finite(values, trial.paired ? 2 : 1).map(([first, last]) =>
      trial.paired ? band(at, first, last, 0.5 * width) : polyline(at, first, last),
    );
    return { type: "group", silent: true, children: shapes.map((points) => ({ type, shape: { points }, style })) };
  };
}

function polyline(at, first, last) {
  return Array.from({ length: last - first }, (_, k) => at(first + k, 0));
}

// Along the largest values, and back along the smallest; pixels are counted downwards.
function band(at, first, last, aside) {
  const points = [];
  for (let k = first; k < last; k += 2) points.push(at(k + 1, -aside));
  for (let k = last - 2; k >= first; k -= 2) points.push(at(k, aside));
  return points;
}

// Runs of finite values, as [first, last) in steps of one or two.
function finite(values, step) {
  const runs = [];
  for (let k = 0, first = null; k <= values.length; k += step) {
    const good = k < values.length && Number.isFinite(values[k]);
    if (good && first === null) first = k;
    if (!good && first !== null) {
      runs.push([first, k]);
      first = null;
    }
  }
  return runs;
}

// Ends of an axis that holds low to high: multiples of a twentieth of the power of ten above the span.
function nice(low, high) {
  const unit = 10 ** Math.ceil(Math.log10(high - low)) / 20;
  // Products of decimal fractions end in ...0001, which would be written at the axis.
  const rounded = (value) => Number((unit * value).toPrecision(12));
  return [rounded(Math.floor(low / unit)), rounded(Math.ceil(high / unit))];
}
