;;; The start of the executive: the configuration lists the features to request and the
;;; files to load, in stages, one request after the other.
;;;
;;;   (executive-init)        asserted by the program to start
;;;   (executive-init-stage)  STAGE-1 -> STAGE-2 -> STAGE-3, or FAILED
;;;   (executive-initialized) all requests of all stages are COMPLETED
;;;
;;; Rules, templates and globals have Fawkes' names. The states of a request:
;;;   PENDING -> FEATURE-REQUESTED -> FEATURE-DONE -> [WAIT-FOR ->] COMPLETED, or ERROR

(defglobal
  ?*CONFIG_PREFIX* = "/clips-executive"
  ?*AGENT_PREFIX* = "/fawkes/agent"
  ?*INIT-STAGES* = (create$ STAGE-1 STAGE-2 STAGE-3)
  ;; the files of the core, loaded before the user's entries of the stage
  ?*CX-STAGE2-FILES* = (create$
    "plan.clp" "goal.clp" "domain.clp" "worldmodel.clp" "cx-identity.clp"
    "wm-domain-sync.clp" "wm-config.clp" "BATCH|skills.clp")
  ;; added to the positions of the user's entries, from 1, to get their orders; smaller orders are of the
  ;; core
  ?*CX-USER-INIT-OFFSET* = 10)

(deffunction cx-stage2-files ()
  "The files of the core. The global keeps Fawkes' value; the files into which the core has split some
   of Fawkes' files follow these."
  (bind ?files (create$))
  (progn$ (?file ?*CX-STAGE2-FILES*)
    (bind ?files (create$ ?files ?file))
    (switch ?file
      (case "domain.clp" then
        (bind ?files (create$ ?files "domain-index.clp" "domain-grounding.clp"
                              "domain-effects.clp" "domain-exogenous.clp")))
      (case "wm-domain-sync.clp" then
        (bind ?files (create$ ?files "wm-domain-sync-facts.clp" "wm-domain-sync-objects.clp")))
      (case "BATCH|skills.clp" then
        (bind ?files (create$ ?files "skills-calls.clp")))))
  ?files)

(deftemplate executive-init-request "A feature to request and files to load."
  (slot stage (type SYMBOL))
  (slot name               ; the feature; any name if the slot feature is FALSE
    (type SYMBOL))
  (slot order              ; in the stage: begins when all smaller ones are COMPLETED
    (type INTEGER))
  (slot feature
    (type SYMBOL) (allowed-values FALSE TRUE))
  (slot wait-for           ; id of the signal to wait for after the files
    (type SYMBOL) (default nil))
  (multislot files         ; NAME, or BATCH|NAME if the file has commands
    (type STRING))
  (slot state
    (type SYMBOL)
    (allowed-values PENDING FEATURE-REQUESTED FEATURE-DONE WAIT-FOR COMPLETED ERROR))
  (multislot error-msgs (type STRING)))

(deftemplate executive-init-signal "The signal for which a request waits (wait-for)."
  (slot id (type SYMBOL))
  (slot ok                 ; FALSE: the stage fails
    (type SYMBOL) (allowed-values TRUE FALSE))
  (slot error-msg (type STRING)))

;; ---- configuration

(defrule executive-load-config
  "Assert a confval fact for each value of the executive and of the agent."
  (declare (salience ?*SALIENCE-INIT*))
  (executive-init)
  =>
  (progn$ (?prefix (create$ ?*CONFIG_PREFIX* ?*AGENT_PREFIX*))
    (config-load ?prefix)))

(deffunction cx-debug-unwatch (?item $?names)
  "Stop watching these facts or rules, even if a later file defines them."
  (printout debug "Unwatching " ?item " " ?names crlf)
  (progn$ (?name ?names) (cx-unwatch ?item (sym-cat ?name))))

(deffunction cx-debug-unwatch-facts ($?templates)
  "Stop watching the facts of these templates."
  (cx-debug-unwatch facts (expand$ ?templates)))

(deffunction cx-debug-unwatch-rules ($?rules)
  "Stop watching these rules."
  (cx-debug-unwatch rules (expand$ ?rules)))

(deffunction cx-debug-check-unwatched (?item ?kind ?known)
  "Log the configured names that no file has defined. ?item is a watch item, ?kind the type of its
   constructs, ?known their names."
  (do-for-fact ((?conf confval))
      (and (eq ?conf:path (str-cat "/clips-executive/debug/unwatch-" ?item)) (eq ?conf:is-list TRUE))
    (progn$ (?name ?conf:list-value)
      (if (not (member$ (sym-cat ?name) ?known)) then
        (printout warn "Cannot unwatch " ?name " (" ?kind " not defined)" crlf)))))

(deffunction cx-debug-check ()
  "Check the configured names after all files are loaded."
  (if (any-factp ((?conf confval))
        (and (eq ?conf:path "/clips-executive/debug/enable") (eq ?conf:value TRUE)))
   then
    (cx-debug-check-unwatched facts deftemplate (get-deftemplate-list))
    (cx-debug-check-unwatched rules defrule (get-defrule-list))))

(defrule executive-enable-debug
  "Watch all facts and rules except those that the configuration excludes, and set the debug level."
  (declare (salience ?*SALIENCE-INIT*))
  (executive-init)
  (confval (path "/clips-executive/debug/enable") (type BOOL) (value TRUE))
  ; without a spec the executive does not start (executive-init-start)
  (confval (path "/clips-executive/spec") (type STRING))
  =>
  (printout t "CLIPS debugging enabled, watching facts and rules" crlf)
  (watch facts)
  (watch rules)
  (do-for-fact ((?conf confval))
      (and (eq ?conf:path "/clips-executive/debug/level") (eq ?conf:type UINT))
    (printout debug "Setting debug level to " ?conf:value " (was " ?*DEBUG* ")" crlf)
    (debug-set-level ?conf:value))
  (do-for-all-facts ((?conf confval))
      (and (eq ?conf:type STRING) (eq ?conf:is-list TRUE)
           (str-prefix "/clips-executive/debug/unwatch-" ?conf:path))
    (if (eq ?conf:path "/clips-executive/debug/unwatch-facts") then
      (cx-debug-unwatch-facts (expand$ ?conf:list-value)))
    (if (eq ?conf:path "/clips-executive/debug/unwatch-rules") then
      (cx-debug-unwatch-rules (expand$ ?conf:list-value)))))

;; ---- from the configuration to requests

(deffunction cx-init-prefix (?spec ?stage)
  "The configuration path of the entries of a stage."
  (str-cat "/clips-executive/specs/" ?spec "/init/" (lowcase ?stage) "/"))

(deffunction cx-init-indexes (?spec ?stage)
  "The indexes of the entries of a stage, in ascending order. ?stage is spelt as in the configuration:
   stage-1."
  (bind ?prefix (cx-init-prefix ?spec ?stage))
  (bind ?begin (+ 1 (str-length ?prefix)))
  (bind ?indexes (create$))
  (do-for-all-facts ((?conf confval)) (str-prefix ?prefix ?conf:path)
    (bind ?relative-path (sub-string ?begin (str-length ?conf:path) ?conf:path))
    (bind ?index (string-to-field (nth$ 1 (str-split ?relative-path "/"))))
    (if (not (integerp ?index)) then
      (printout error "Init entry " ?conf:path " has no number after " ?prefix ", ignoring it" crlf)
     else
      (if (not (member$ ?index ?indexes)) then (bind ?indexes (create$ ?indexes ?index)))))
  (if (eq 0 (length$ ?indexes)) then (return ?indexes))
  (sort > ?indexes))

(deffunction cx-init-entry-value (?path ?default)
  "The configured value at the path, or the default."
  (do-for-fact ((?conf confval)) (eq ?conf:path ?path)
    (return (if (eq ?conf:is-list TRUE) then ?conf:list-value else ?conf:value)))
  ?default)

(deffunction cx-init-entry-files (?entry)
  "All files of an entry: the value of file, then the list files."
  (bind ?files (create$))
  (bind ?file (cx-init-entry-value (str-cat ?entry "file") nil))
  ; create$ and expand$ because the value is a list if the configuration has a list for file by mistake
  (if (neq ?file nil) then (bind ?files (create$ (str-cat (expand$ (create$ ?file))))))
  (bind ?list (cx-init-entry-value (str-cat ?entry "files") (create$)))
  (if (multifieldp ?list) then (return (create$ ?files ?list)))
  (printout warn "Config entry " ?entry "files is not a list value, ignoring" crlf)
  ?files)

(deffunction cx-assert-init-requests (?spec ?stage ?feature-default)
  "Assert a request for each configured entry of the stage."
  (progn$ (?index (cx-init-indexes ?spec (lowcase ?stage)))
    (bind ?entry (str-cat (cx-init-prefix ?spec ?stage) ?index "/"))
    (bind ?order (+ ?index-index ?*CX-USER-INIT-OFFSET*))
    (bind ?name (cx-init-entry-value (str-cat ?entry "name") nil))
    (if (eq ?name nil)
     then
      (assert (executive-init-request
        (stage ?stage) (order ?order) (name MISSING) (feature ?feature-default) (state ERROR)
        (error-msgs (str-cat ?stage " entry " ?index " is missing name entry"))))
     else
      (assert (executive-init-request
        (stage ?stage) (order ?order) (name (sym-cat ?name)) (state PENDING)
        (feature (cx-init-entry-value (str-cat ?entry "feature-request") ?feature-default))
        (files (cx-init-entry-files ?entry))
        (wait-for (sym-cat (cx-init-entry-value (str-cat ?entry "wait-for") nil))))))))

(defrule executive-init-start
  "Assert the requests of the core and of the spec. Without a spec the executive does not start."
  (declare (salience ?*SALIENCE-INIT-LATE*))
  (executive-init)
  (confval (path "/clips-executive/spec") (type STRING) (value ?spec))
  =>
  (assert (executive-init-request (stage STAGE-1) (order 0) (name blackboard)
            (feature TRUE) (files "BATCH|blackboard-init.clp")))
  (cx-assert-init-requests ?spec STAGE-1 TRUE)
  (assert (executive-init-request (stage STAGE-2) (order 0) (name cx-files)
            (feature FALSE) (files (cx-stage2-files))))
  (cx-assert-init-requests ?spec STAGE-2 FALSE)
  (cx-assert-init-requests ?spec STAGE-3 FALSE)
  (assert (executive-init-stage STAGE-1)))

;; ---- one request after the other

(defrule executive-init-failed
  "A request of the current stage failed, so the start fails."
  (declare (salience ?*SALIENCE-INIT*))
  (executive-init)
  ?current <- (executive-init-stage ?stage)
  (executive-init-request (stage ?stage) (state ERROR) (order ?order) (error-msgs $?problems))
  =>
  (retract ?current)
  (bind ?line "***********************************************************")
  (printout error crlf)
  (printout error ?line crlf)
  (printout error crlf)
  (printout error ?stage " request " ?order " failed: " ?problems crlf)
  (printout error crlf)
  (printout error ?line crlf)
  (printout error crlf)
  (assert (executive-init-stage FAILED)))

(defrule executive-init-stage-request-feature
  (executive-init)
  (executive-init-stage ?stage)
  ?request <- (executive-init-request (stage ?stage) (state PENDING) (feature TRUE)
                                      (name ?feature) (order ?order))
  (ff-feature ?feature)
  (not (executive-init-request (stage ?stage) (state ~COMPLETED) (order ?earlier&:(< ?earlier ?order))))
  =>
  (printout t "Init " ?stage ": requesting feature " ?feature crlf)
  (ff-feature-request (str-cat ?feature))
  (modify ?request (state FEATURE-REQUESTED)))

(defrule executive-init-stage-request-feature-unavailable
  "No plug-in offers the feature. The start does not wait for a later offer."
  (executive-init)
  (executive-init-stage ?stage)
  ?request <- (executive-init-request (stage ?stage) (state PENDING) (feature TRUE)
                                      (name ?feature) (order ?order))
  (not (ff-feature ?feature))
  (not (executive-init-request (stage ?stage) (state ~COMPLETED) (order ?earlier&:(< ?earlier ?order))))
  =>
  (printout error "Init " ?stage ": feature " ?feature " is not available" crlf)
  (modify ?request (state ERROR) (error-msgs (str-cat "Feature " ?feature " is not available"))))

(defrule executive-init-stage-request-feature-fulfilled
  (executive-init)
  (executive-init-stage ?stage)
  ?request <- (executive-init-request (stage ?stage) (state FEATURE-REQUESTED) (name ?feature))
  (ff-feature-loaded ?feature)
  =>
  (printout debug "Init " ?stage ": feature request for " ?feature " has been fulfilled" crlf)
  (modify ?request (state FEATURE-DONE)))

(defrule executive-init-stage-request-no-feature
  (executive-init)
  (executive-init-stage ?stage)
  ?request <- (executive-init-request (stage ?stage) (state PENDING) (feature FALSE) (order ?order))
  (not (executive-init-request (stage ?stage) (state ~COMPLETED) (order ?earlier&:(< ?earlier ?order))))
  =>
  (modify ?request (state FEATURE-DONE)))

(deffunction cx-init-load (?file)
  "Load a file, or execute its commands if the name starts with BATCH| or BATCH*|. Another prefix before
   a bar is dropped, as in Fawkes. The functions called log errors, and assert a path-info fact."
  (bind ?bar (str-index "|" ?file))
  (if (not ?bar) then (return (path-load ?file)))
  (bind ?mode (sub-string 1 (- ?bar 1) ?file))
  (bind ?name (sub-string (+ ?bar 1) (str-length ?file) ?file))
  (if (or (eq ?mode "BATCH") (eq ?mode "BATCH*"))
   then (path-batch* ?name)
   else (path-load ?name)))

(defrule executive-init-stage-request-files
  (executive-init)
  (executive-init-stage ?stage)
  ?request <- (executive-init-request (stage ?stage) (state FEATURE-DONE) (name ?name)
                                      (files $?files) (wait-for ?signal))
  =>
  (if (neq ?files (create$)) then
    (printout t "Init " ?stage ": loading files for " ?name " " ?files crlf)
    (progn$ (?file ?files) (cx-init-load ?file)))
  (if (eq ?signal nil)
   then
    (modify ?request (state COMPLETED))
   else
    (printout t "Init " ?stage ": waiting for signal " ?signal " by " ?name crlf)
    (modify ?request (state WAIT-FOR))))

(defrule executive-init-stage-wait-for-ok
  (executive-init)
  (executive-init-stage ?stage)
  ?request <- (executive-init-request (stage ?stage) (state WAIT-FOR) (name ?name) (wait-for ?id))
  ?signal <- (executive-init-signal (id ?id) (ok TRUE))
  =>
  (printout info "Init " ?stage ": signal " ?id " by " ?name " received" crlf)
  (retract ?signal)
  (modify ?request (state COMPLETED)))

(defrule executive-init-stage-wait-for-fail
  (executive-init)
  (executive-init-stage ?stage)
  ?request <- (executive-init-request (stage ?stage) (state WAIT-FOR) (wait-for ?id))
  ?signal <- (executive-init-signal (id ?id) (ok FALSE) (error-msg ?problem))
  =>
  (retract ?signal)
  (modify ?request (state ERROR) (error-msgs ?problem)))

(defrule executive-init-stage-finished
  (executive-init)
  ?current <- (executive-init-stage ?stage&~FAILED)
  (not (executive-init-request (stage ?stage) (state ~COMPLETED)))
  =>
  (bind ?following (+ 1 (member$ ?stage ?*INIT-STAGES*)))
  (retract ?current)
  (if (> ?following (length$ ?*INIT-STAGES*))
   then
    (cx-debug-check)
    (printout t "Initialization completed" crlf)
    (assert (executive-initialized))
   else
    (bind ?next (nth$ ?following ?*INIT-STAGES*))
    (printout t "Init " ?stage ": finished, advancing to " ?next crlf)
    (assert (executive-init-stage ?next))))
