// The page of a training: pneumorphTraining.show(snapshot) draws it, listen() draws what is sent.
var pneumorphTraining = globalThis.pneumorphTraining || (() => {
  let shownReplay = null;
  const find = (id) => document.getElementById(id);

  function show(snapshot) {
    find("status").textContent = snapshot.status;
    for (const part of ["numbers", "figures", "designs"]) {
      if (find(part).innerHTML !== snapshot[part]) find(part).innerHTML = snapshot[part];
    }
    // The best robot goes on crawling while it stays the best.
    const text = JSON.stringify(snapshot.replay);
    if (text !== shownReplay) {
      for (const player of [...pneumorphReplay.players]) player.dispose();
      shownReplay = text;
      if (snapshot.replay) pneumorphReplay.mount(find("replay"), snapshot.replay).play();
    }
    pneumorphTraining.updates += 1;
  }

  function listen() {
    const events = new EventSource("/events");
    events.addEventListener("snapshot", (event) => show(JSON.parse(event.data)));
    events.addEventListener("end", () => events.close());
  }

  return { show, listen, updates: 0 };
})();
