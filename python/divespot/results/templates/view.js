(async function () {
  "use strict";
  const text = id => document.getElementById(id).textContent;
  const view = document.getElementById("view");
  const words = WORDS;
  const fail = error => { view.textContent = words.failed; view.dataset.failed = String(error); };
  try {
    const bytes = Uint8Array.from(atob(text("plotly")), c => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    const script = document.createElement("script");
    script.textContent = await new Response(stream).text();
    document.head.appendChild(script);
  } catch (error) { return fail(error); }
  const scene = JSON.parse(text("scene"));
  const tint = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const stops = colors => colors.map((color, i) => [i / (colors.length - 1), color]);
  const flat = colors => colors.flatMap((color, i) => [[i / colors.length, color], [(i + 1) / colors.length, color]]);
  const ground = "#cfc8b8";
  const palette = ["#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377"];
  const piles = [ground, ...Array.from({ length: Math.max(scene.piles, 1) }, (_, i) => palette[i % palette.length])];
  const warm = stops(["#d9d3c3", "#fee391", "#fe9929", "#cc4c02", "#662506"]);
  const modes = {
    height: { surfacecolor: scene.z, colorscale: warm, cmin: 0, cmax: scene.top, showscale: true },
    pile: { surfacecolor: scene.pile, colorscale: flat(piles), cmin: -0.5, cmax: piles.length - 0.5, showscale: false },
    seen: { surfacecolor: scene.filled, colorscale: flat(["#8fa3ad", "#c0392b"]), cmin: -0.5, cmax: 1.5, showscale: false }
  };
  const lighting = { ambient: 0.6, diffuse: 0.7, specular: 0.05, roughness: 0.9 };
  const surface = { type: "surface", x: scene.x, y: scene.y, z: scene.z, lighting, colorbar: { title: { text: "m" }, thickness: 12, len: 0.6 }, hovertemplate: "%{z:.3f} m<extra></extra>", ...modes.height };
  const base = { type: "surface", x: scene.x, y: scene.y, z: scene.base, visible: false, showscale: false, opacity: 0.85, colorscale: [[0, "#00667a"], [1, "#00667a"]], hovertemplate: "%{z:.3f} m<extra></extra>" };
  const of = key => scene.labels.map(label => label[key]);
  const labels = { type: "scatter3d", mode: "text", x: of("x"), y: of("y"), z: of("z"), text: of("text"), textposition: "top center", hoverinfo: "skip", showlegend: false };
  const axis = () => ({ color: tint("--soft"), gridcolor: tint("--line"), zerolinecolor: tint("--line"), showbackground: false, title: { text: "" } });
  const look = () => ({ paper_bgcolor: "rgba(0,0,0,0)", font: { color: tint("--ink") }, margin: { l: 0, r: 0, t: 0, b: 0 }, uirevision: "kept", scene: { aspectmode: "data", xaxis: axis(), yaxis: axis(), zaxis: axis(), camera: { eye: { x: 0.9, y: -1.2, z: 0.9 } } } });
  try {
    await Plotly.newPlot(view, [surface, base, labels], look(), { responsive: true, displaylogo: false });
  } catch (error) { return fail(error); }
  view.dataset.ready = "true";
  const press = (button, on) => button.setAttribute("aria-pressed", on);
  const colors = [...document.querySelectorAll("button[data-color]")];
  for (const button of colors) {
    button.addEventListener("click", () => {
      colors.forEach(other => press(other, other === button));
      const mode = modes[button.dataset.color];
      Plotly.restyle(view, Object.fromEntries(Object.entries(mode).map(([key, value]) => [key, [value]])), [0]);
    });
  }
  const toggle = document.getElementById("base");
  toggle.addEventListener("click", () => {
    const on = toggle.getAttribute("aria-pressed") !== "true";
    press(toggle, on);
    // The surface hides the base, so it is made transparent while the base is shown.
    Plotly.restyle(view, { visible: on }, [1]);
    Plotly.restyle(view, { opacity: on ? 0.55 : 1 }, [0]);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => Plotly.relayout(view, look()));
})();
