// SPDX-License-Identifier: BSD-3-Clause
//
// Search in pages that are opened from the disk.  Browsers start no workers there, so the worker's script runs in a hidden frame
// instead.  The theme's script asks for window.IFrameWorker to find its other files.
if (location.protocol === "file:") {
  class IFrameWorker extends EventTarget {
    constructor(url) {
      super();
      this.onmessage = null;
      this.early = []; // messages to a script that is still being read
      this.frame = document.createElement("iframe");
      this.frame.hidden = true;
      this.frame.srcdoc = "<!doctype html>";
      this.frame.addEventListener("load", () => this.start(String(url)), { once: true });
      document.documentElement.appendChild(this.frame);
    }

    start(url) {
      const inside = this.frame.contentWindow;
      inside.postMessage = (data) => setTimeout(() => this.tell(data));
      inside.importScripts = (...scripts) => scripts.reduce((before, script) => before.then(() => load(inside, script)), Promise.resolve());
      load(inside, url).then(() => {
        const early = this.early;
        this.early = null;
        for (const data of early) this.postMessage(data);
      });
    }

    tell(data) {
      const event = new MessageEvent("message", { data });
      if (this.onmessage) this.onmessage(event);
      this.dispatchEvent(event);
    }

    postMessage(data) {
      if (this.early) {
        this.early.push(data);
        return;
      }
      const inside = this.frame.contentWindow;
      inside.dispatchEvent(new inside.MessageEvent("message", { data }));
    }

    terminate() {
      this.frame.remove();
    }
  }

  function load(inside, url) {
    return new Promise((done, failed) => {
      const script = inside.document.createElement("script");
      script.src = url;
      script.onload = done;
      script.onerror = failed;
      inside.document.head.appendChild(script);
    });
  }

  window.Worker = window.IFrameWorker = IFrameWorker;
}
