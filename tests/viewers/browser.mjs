// The browser of the tests and of the README's film: headless Chromium, with WebGL without a graphics card.
import { chromium } from "playwright-core";

const args = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"];

/** Without a graphics card every picture takes a processor for a moment: of all that a page asks for, some ten a second. */
const drawsCalmly = () => {
  const draw = requestAnimationFrame.bind(window), wanted = new Set();
  let last = 0;
  window.requestAnimationFrame = (call) => {
    const number = ++last;
    wanted.add(number);
    setTimeout(() => draw((now) => { if (wanted.delete(number)) call(now); }), 80);
    return number;
  };
  window.cancelAnimationFrame = (number) => wanted.delete(number);
};

export const launched = async ({ calm = true } = {}) => {
  const browser = await chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args });
  if (!calm) return browser;
  const newContext = browser.newContext.bind(browser);
  browser.newContext = async (options) => {
    const context = await newContext(options);
    await context.addInitScript(drawsCalmly);
    return context;
  };
  return browser;
};
