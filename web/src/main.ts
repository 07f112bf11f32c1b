import { mount } from "svelte";
import App from "./App.svelte";
import { live } from "./store/live.svelte";
import "./styles/tokens.css";
import "./styles/shell.css";
import "./styles/panels.css";
import "./styles/pages.css";

const target = document.getElementById("app");
if (!target) throw new Error("the page has no element for the dashboard");
mount(App, { target });
live.start();
