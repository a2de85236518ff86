// Debian's Chromium under playwright-core, and what every page of ours has to keep.
import { chromium } from 'playwright-core';

export const CHROMIUM = process.env.CHROMIUM || '/usr/bin/chromium';
const failures = [];

export function check(holds, what) {
  if (!holds) { failures.push(what); console.error(`FAILED: ${what}`); }
}

export function finish() {
  process.exitCode = failures.length ? 1 : 0;
}

export function launch() {
  return chromium.launch({
    executablePath: CHROMIUM,
    args: ['--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync'],
  });
}

// A page that keeps note of console errors, exceptions, and requests to anybody but `home`. While `troubled`, a refused
// connection is expected.
export async function open(browser, home, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1400, height: 900 }, ...options });
  const page = await context.newPage();
  const notes = { troubled: false };
  page.on('console', m => { if (m.type() === 'error' && !notes.troubled) check(false, `console: ${m.text()}`); });
  page.on('pageerror', e => check(false, `exception: ${e.message}`));
  page.on('request', r => { if (!r.url().startsWith(home) && !/^(data|blob):/.test(r.url())) check(false, `request to another host: ${r.url()}`); });
  return { context, page, notes };
}

// Right at both widths, in both themes: nothing sticks out. Pictures go to TRUERATE_SHOTS, where that is set.
export async function looks(page, name) {
  for (const width of [1400, 390]) {
    for (const colorScheme of ['light', 'dark']) {
      await page.setViewportSize({ width, height: 900 });
      await page.emulateMedia({ colorScheme });
      await page.waitForTimeout(400);
      const beyond = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
      check(beyond <= 0, `${name} at ${width} px, ${colorScheme}: sticks out by ${beyond} px`);
      const ground = await page.evaluate(() => getComputedStyle(document.body).backgroundColor.match(/\d+/g).slice(0, 3).reduce((a, b) => a + +b, 0));
      check(colorScheme === 'dark' ? ground < 150 : ground > 600, `${name}: ${colorScheme} theme has a ground of brightness ${ground}`);
      // The samples of colour in a legend are those of the theme, whichever it was drawn in.
      const stale = await page.evaluate(() => [...document.querySelectorAll('.u-legend .u-series')].filter(row => row.querySelector('.u-label').textContent === 'model').map(row => getComputedStyle(row.querySelector('.u-marker'))).filter(style => {
        const wanted = document.createElement('i');
        wanted.style.color = 'var(--model)';
        document.body.append(wanted);
        const colour = getComputedStyle(wanted).color;
        wanted.remove();
        return style.backgroundColor !== colour || style.borderTopWidth !== '0px';
      }).length);
      check(stale === 0, `${name}, ${colorScheme}: ${stale} samples of a legend have another theme's colour`);
      if (process.env.TRUERATE_SHOTS) await page.screenshot({ path: `${process.env.TRUERATE_SHOTS}/${name}-${width}-${colorScheme}.png`, fullPage: true });
    }
  }
  await page.setViewportSize({ width: 1400, height: 900 });
}

// Whether anything is drawn on the chart in `place`, as a fingerprint of its pixels.
export const picture = (page, place) => page.locator(`${place} canvas`).first().evaluate(c => c.toDataURL());

export async function until(what, seconds, test) {
  const end = Date.now() + 1000 * seconds;
  while (Date.now() < end) {
    const found = await test();
    if (found) return found;
    await new Promise(done => setTimeout(done, 200));
  }
  check(false, `${what}: not within ${seconds} s`);
  return null;
}
