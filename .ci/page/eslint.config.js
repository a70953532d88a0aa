import js from "@eslint/js";
import globals from "globals";

// `cx` is made by base.js, which the page loads first
export default [
  js.configs.recommended,
  {
    languageOptions: { globals: { ...globals.browser, cx: "readonly" } },
    rules: { eqeqeq: "error", "no-var": "error", "prefer-const": "error" },
  },
];
