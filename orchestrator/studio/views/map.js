// A map of boxes over two coordinates; drag to select a region.
import { echarts } from "nicegui-echart";
import { selectByDragging } from "misfit-views";

const [LEFT, RIGHT, BOTTOM, TOP, , SHOWN] = [0, 1, 2, 3, 4, 5]; // places in an entry of the data; 4 is the value
const FAINT = 0.22;

export default {
  template: `<div tabindex="0" class="view-plot">
    <div ref="canvas" class="view-canvas"></div><div ref="band" class="view-band"></div></div>`,
  props: { options: Object },
  async mounted() {
    await new Promise((resolve) => setTimeout(resolve, 0)); // until the style sheet gives the element its size
    this.chart = echarts.init(this.$refs.canvas);
    this.change(this.options);
    selectByDragging(this.$refs.canvas, this.$refs.band, true, () => true, (...corners) => this.brush(...corners));
    this.$el.addEventListener("keydown", (event) => event.key === "Escape" && this.$emit("brush", null));
    this.resizes = new ResizeObserver(() => this.chart.resize());
    this.resizes.observe(this.$el);
  },
  beforeUnmount() {
    this.resizes?.disconnect();
    this.chart?.dispose();
  },
  watch: {
    options(options) {
      this.change(options);
    },
  },
  methods: {
    change(options) {
      const series = options.series.map((each) => (each.type === "custom" ? { ...each, renderItem: box } : each));
      this.chart?.setOption({ ...options, series }, { notMerge: true });
    },
    brush(...corners) {
      const [one, other] = corners.map((corner) => this.chart.convertFromPixel({ gridIndex: 0 }, corner));
      this.$emit("brush", { across: [one[0], other[0]], along: [one[1], other[1]] });
    },
  },
};

function box(params, api) {
  const [left, top] = api.coord([api.value(LEFT), api.value(TOP)]);
  const [right, bottom] = api.coord([api.value(RIGHT), api.value(BOTTOM)]);
  return {
    type: "rect",
    shape: { x: left, y: top, width: Math.ceil(right - left), height: Math.ceil(bottom - top) },
    style: { fill: api.visual("color"), opacity: api.value(SHOWN) ? 1 : FAINT },
  };
}
