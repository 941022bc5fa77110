// Two pictures over one another: the right one is cut off at the divider.
"use strict";
for (const viewer of document.querySelectorAll(".viewer")) {
  const get = (selector) => viewer.querySelector(selector);
  const [stage, under, over] = [".stage", ".under", ".over"].map(get);
  const [divider, slider, zoomed] = [".divider", ".slider", "output"].map(get);
  const width = Number(viewer.dataset.width);
  // Place of the picture in the stage, and its scale; both pictures have the same.
  let scale = 1, x = 0, y = 0;

  const images = (kind) => viewer.querySelectorAll(`.store img[data-kind="${kind}"]`);
  function choose() {
    const all = images(get(".kind").value);
    under.src = all[get(".left").value].src;
    over.src = all[get(".right").value].src;
  }

  function place() {
    const first = images("picture")[0];
    const height = (first.naturalHeight / first.naturalWidth) * width;
    const shown = Math.max(2, Math.ceil(512 / width));
    stage.style.width = `${Math.min(stage.parentElement.clientWidth, shown * width)}px`;
    stage.style.height = `${(stage.clientWidth / width) * height}px`;
    slider.style.width = stage.style.width;
    const size = stage.clientWidth * scale;
    x = Math.min(0, Math.max(stage.clientWidth - size, x));
    y = Math.min(0, Math.max(stage.clientHeight - (size / width) * height, y));
    for (const image of [under, over]) {
      image.style.width = `${size}px`;
      image.style.transform = `translate(${x}px, ${y}px)`;
    }
    const cut = (slider.value / 100) * stage.clientWidth;
    divider.style.left = `${cut}px`;
    over.style.clipPath = `inset(0 0 0 ${cut - x}px)`;
    zoomed.textContent = `${Math.round(scale * 100)} %`;
  }

  // Keeps the point (px, py) of the stage where it is.
  function zoom(factor, px, py) {
    const next = Math.min(32, Math.max(1, scale * factor));
    x = px - ((px - x) * next) / scale;
    y = py - ((py - y) * next) / scale;
    scale = next;
    place();
  }

  stage.addEventListener("wheel", (event) => {
    event.preventDefault();
    if (event.deltaY === 0) return;
    const box = stage.getBoundingClientRect();
    zoom(event.deltaY < 0 ? 1.25 : 0.8, event.clientX - box.left, event.clientY - box.top);
  }, { passive: false });
  // Dragging moves the divider, or with shift or the middle button the picture.
  stage.addEventListener("pointerdown", (event) => {
    stage.setPointerCapture(event.pointerId);
    if (event.button === 0 && !event.shiftKey) move(event);
  });
  stage.addEventListener("pointermove", (event) => [1, 4].includes(event.buttons) && move(event));
  function move(event) {
    if (event.type === "pointermove" && (event.shiftKey || event.buttons === 4)) {
      x += event.movementX;
      y += event.movementY;
    } else {
      const box = stage.getBoundingClientRect();
      slider.value = (100 * (event.clientX - box.left)) / box.width;
    }
    place();
  }
  slider.addEventListener("input", place);
  for (const select of viewer.querySelectorAll("select")) select.addEventListener("change", choose);
  for (const button of viewer.querySelectorAll("button")) {
    const factor = button.dataset.zoom === "in" ? 2 : 0.5;
    const middle = () => [stage.clientWidth / 2, stage.clientHeight / 2];
    button.addEventListener("click", () => zoom(factor, ...middle()));
  }
  window.addEventListener("resize", place);
  const first = images("picture")[0];
  first.decode().then(() => { choose(); place(); viewer.dataset.ready = "yes"; });
}
