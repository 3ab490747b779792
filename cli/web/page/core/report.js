// The loop that draws, and what it costs: `robactorReport()` in the browser's console, and in tests.

const KEPT = 600; // pictures

export function startReport(link, draw) {
  const work = []; // ms of our code in a picture
  const gaps = []; // ms from picture to picture
  const long = []; // ms of tasks over 50 ms
  let before = performance.now();
  const keep = (list, value) => {
    list.push(value);
    if (list.length > KEPT) list.shift();
  };
  let pictures = 0;
  const frame = (now) => {
    pictures++;
    keep(gaps, now - before);
    before = now;
    const begin = performance.now();
    draw();
    keep(work, performance.now() - begin);
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
  if (PerformanceObserver.supportedEntryTypes?.includes("longtask"))
    new PerformanceObserver((entries) => entries.getEntries().forEach((one) => keep(long, one.duration))).observe({
      type: "longtask",
    });
  window.robactorReport = () => ({
    connected: link.connected,
    received: link.received,
    drawn: pictures,
    errors: link.errors,
    work: quantiles(work),
    gaps: quantiles(gaps),
    longTasks: long.length,
    view: window.robactorView,
  });
}

function quantiles(values) {
  const sorted = [...values].sort((a, b) => a - b);
  const at = (share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))] ?? 0;
  return { count: sorted.length, p50: at(0.5), p99: at(0.99), most: at(1) };
}
