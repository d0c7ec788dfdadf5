// A page that is told of a simulation's frames as they come.
(() => {
  const element = document.currentScript.previousElementSibling;
  element.textContent = "Waiting for the first frame ...";
  const events = new EventSource("/events");
  let player = null;
  events.addEventListener("start", (event) => {
    if (player) player.dispose();
    player = pneumorphReplay.mount(element, JSON.parse(event.data), { live: true });
  });
  events.addEventListener("frame", (event) => player.append(JSON.parse(event.data)));
  events.addEventListener("end", () => {
    events.close();
    if (player) player.finish();
  });
})();
