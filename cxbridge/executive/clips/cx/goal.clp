;;; Goals: their template, the retraction of goal trees, and the meta facts of goals.
;;;
;;; The life of a goal:
;;;   FORMULATED -> SELECTED -> EXPANDED -> COMMITTED -> DISPATCHED -> FINISHED
;;;              -> EVALUATED -> RETRACTED
;;; The user's reasoner and action selection change the mode of a leaf. The rules of the
;;; sub-type (goals/*.clp) change the mode of a goal with sub-goals.
;;;
;;; Rules match goals by joins on id and parent, which CLIPS hashes. The change of a goal
;;; or plan does not make a rule of this file search all goals or plans.

(deftemplate goal
  "A goal to achieve (ACHIEVE), or a condition to maintain (MAINTAIN)."
  (slot id (type SYMBOL))
  (slot class                ; the kind of goal, by which expanders choose
    (type SYMBOL))
  (slot type                 ; MAINTAIN goals do not end; rules of sub-types skip
                             ; them, except that RUN-SUBGOALS-IN-PARALLEL selects them
    (type SYMBOL) (allowed-values ACHIEVE MAINTAIN) (default ACHIEVE))
  (slot sub-type             ; how sub-goals are pursued; nil for a leaf
    (type SYMBOL))
  (slot parent               ; id of the parent goal; nil for a root
    (type SYMBOL))
  (slot mode
    (type SYMBOL)
    (allowed-values FORMULATED SELECTED EXPANDED COMMITTED
                    DISPATCHED FINISHED EVALUATED RETRACTED))
  (slot outcome              ; set when the goal is FINISHED
    (type SYMBOL) (allowed-values UNKNOWN COMPLETED FAILED REJECTED))
  (multislot warning)
  (multislot error)          ; a code such as SUB-GOAL-FAILED, and details
  (slot message              ; the error as a sentence
    (type STRING))
  (slot priority             ; the higher priority goes first
    (type FLOAT) (default 0.0))
  (multislot params)         ; set with the goal: key value, key value ...
  (multislot meta)           ; data of reasoners, and of the sub-types RETRY and TIMEOUT
  (slot meta-fact            ; index of a fact with a slot goal-id; 0: none ...
    (type INTEGER) (default 0))
  (slot meta-template        ; ... and its template; one of the two is enough
    (type SYMBOL))
  (multislot required-resources   ; DISPATCHED only after all are acquired
    (type SYMBOL))
  (multislot acquired-resources   ; released after RETRACTED
    (type SYMBOL))
  (slot committed-to         ; id of the plan, or of the sub-goal
    (type SYMBOL))
  (slot verbosity
    (type SYMBOL) (allowed-values QUIET DEFAULT NOISY) (default DEFAULT))
  (slot is-executable        ; whether the goal could be expanded now
    (type SYMBOL) (allowed-values TRUE FALSE) (default FALSE)))

;; A goal without an id could have no sub-goals, because the parent nil means no parent.
(defrule goal-without-id
  "A goal without an id gets <class>-genN, as goals in trees do."
  (declare (salience ?*SALIENCE-FIRST*))
  ?goal <- (goal (id nil) (class ?class) (mode FORMULATED))
  =>
  (cx-modify-goal ?goal (id (sym-cat ?class - (gensym*)))))

(deffunction goal-param-positive (?params ?name)
  "TRUE if the parameters are the name and a number above zero, and nothing else."
  (if (or (<> 2 (length$ ?params)) (neq ?name (nth$ 1 ?params))) then (return FALSE))
  (bind ?value (nth$ 2 ?params))
  (if (numberp ?value) then (> ?value 0) else FALSE))

(defrule goal-print-error
  (goal (id ?id) (class ?class) (mode RETRACTED) (outcome FAILED)
        (error ?code $?details) (message ?message&~""))
  =>
  (printout error "Goal " ?id " (" ?class ") failed: " ?message " " (create$ ?code ?details) crlf))

;; ---- the retraction of goals and their plans
;;
;; (goal-tree-retract ID) requests the retraction of a goal with its descendants and all their plans,
;; (goal-plan-retract GOAL-ID PLAN-ID) that of a plan with its actions. Leaves are retracted first.
;; The parent nil means no parent, hence ?id&~nil; a goal may be its own parent, hence ?child&~?id.

(deffunction goal-retract-goal-tree (?id)
  "Retract the goal, its descendants and all their plans, at once. For rules of users: the
   function searches all goals for each level of the tree, and once more, as all plans and
   actions. The rules of the core assert (goal-tree-retract ID) instead."
  ; nil would be the parent of all root goals
  (bind ?level (if (eq ?id nil) then (create$) else (create$ ?id)))
  (bind ?tree (create$))
  (while (> (length$ ?level) 0)
    (bind ?tree (create$ ?tree ?level))
    (bind ?below (create$))
    (do-for-all-facts ((?g goal)) (member$ ?g:parent ?level)
      ; the parents may form a cycle
      (if (not (member$ ?g:id ?tree)) then (bind ?below (create$ ?below ?g:id))))
    (bind ?level ?below))
  (delayed-do-for-all-facts ((?action plan-action)) (member$ ?action:goal-id ?tree)
    (retract ?action))
  (delayed-do-for-all-facts ((?plan plan)) (member$ ?plan:goal-id ?tree)
    (retract ?plan))
  (delayed-do-for-all-facts ((?g goal)) (member$ ?g:id ?tree)
    (retract ?g)))

(defrule goal-retract
  "Retract a RETRACTED root, or child of a MAINTAIN goal, after it has released its resources."
  (confval (path "/clips-executive/automatic-goal-retraction") (type BOOL) (value TRUE))
  (goal (id ?id) (mode RETRACTED) (parent ?parent) (acquired-resources))
  (or (test (eq ?parent nil))
      (goal (id ?parent&~nil) (type MAINTAIN)))
  =>
  (printout t "Retracting goal " ?id crlf)
  (assert (goal-tree-retract ?id)))

(defrule goal-tree-retract-children
  (declare (salience ?*SALIENCE-FIRST*))
  (goal-tree-retract ?id&~nil)
  (goal (id ?child&~?id) (parent ?id))
  =>
  (assert (goal-tree-retract ?child)))

(defrule goal-tree-retract-leaf
  "The goal has no sub-goals and no plans."
  (declare (salience ?*SALIENCE-FIRST*))
  ?request <- (goal-tree-retract ?id)
  (not (goal (id ~?id) (parent ?id&~nil)))
  (not (plan (goal-id ?id)))
  (not (plan-action (goal-id ?id)))
  ?goal <- (goal (id ?id))
  =>
  (retract ?goal ?request))

(defrule goal-tree-retract-cycle
  "No goal of a cycle of parents is a leaf. After all leaves are gone (FIRST-LATE), retract any goal of
   the cycle; the other goals are a tree then."
  (declare (salience ?*SALIENCE-FIRST-LATE*))
  ?request <- (goal-tree-retract ?id)
  (goal-tree-retract ?child&~?id)
  (goal (id ?child) (parent ?id))
  ?goal <- (goal (id ?id))
  =>
  (retract ?goal ?request))

(defrule goal-tree-retract-without-goal
  "Another rule has retracted the goal."
  (declare (salience ?*SALIENCE-FIRST*))
  ?request <- (goal-tree-retract ?id)
  (not (goal (id ?id)))
  =>
  (retract ?request))

(defrule goal-cleanup-plans
  "Retract the plans of a RETRACTED goal before other rules react to its mode, because a goal that is
   tried again must have no former plan."
  (declare (salience ?*SALIENCE-HIGH*))
  (confval (path "/clips-executive/automatic-goal-retraction") (type BOOL) (value TRUE))
  (goal (id ?id) (mode RETRACTED))
  (plan (goal-id ?id) (id ?plan-id))
  =>
  (assert (goal-plan-retract ?id ?plan-id)))

(defrule goal-tree-retract-plan
  (declare (salience ?*SALIENCE-FIRST*))
  (goal-tree-retract ?id)
  (plan (goal-id ?id) (id ?plan-id))
  =>
  (assert (goal-plan-retract ?id ?plan-id)))

(defrule goal-tree-retract-action-without-plan
  (declare (salience ?*SALIENCE-FIRST*))
  (goal-tree-retract ?id)
  ?action <- (plan-action (goal-id ?id) (plan-id ?plan-id))
  (not (plan (goal-id ?id) (id ?plan-id)))
  =>
  (retract ?action))

(defrule goal-plan-retract-action
  (declare (salience ?*SALIENCE-FIRST*))
  (goal-plan-retract ?id ?plan-id)
  ?action <- (plan-action (goal-id ?id) (plan-id ?plan-id))
  =>
  (retract ?action))

(defrule goal-plan-retract-plan
  "All actions of the plan are retracted."
  (declare (salience ?*SALIENCE-FIRST*))
  ?request <- (goal-plan-retract ?id ?plan-id)
  (not (plan-action (goal-id ?id) (plan-id ?plan-id)))
  ?plan <- (plan (goal-id ?id) (id ?plan-id))
  =>
  (retract ?plan ?request))

;; ---- meta facts: the data of an application about a goal, in a fact with a slot goal-id

;; Rules that keep goals and meta facts consistent have the salience HIGH, so that rules at salience 0
;; see consistent data.

(deftemplate goal-meta-link
  "Internal. The fact address for the index goal.meta-fact; FALSE without such a fact. The check whether
   the fact of an address exists is cheap, but the search for an index walks through all facts."
  (slot goal-id) (slot index) (slot fact))

(deffunction goal-meta-template-known (?template)
  "TRUE if the template exists; FALSE for nil."
  (and (neq ?template nil)
       (neq FALSE (member$ ?template (get-deftemplate-list)))))

(deffunction goal-meta-template-usable (?template)
  "TRUE if the template exists and has a slot goal-id."
  (and (goal-meta-template-known ?template)
       (deftemplate-slot-existp ?template goal-id)))

(deffunction goal-meta-find (?template ?id)
  "The index of the first fact of the template for the goal; 0 if there is none."
  (do-for-fact ((?meta ?template)) (eq ?meta:goal-id ?id)
    (return (fact-index ?meta)))
  0)

(deffunction goal-meta-count (?template ?id)
  "The number of facts of the template for the goal."
  (length$ (find-all-facts ((?meta ?template)) (eq ?meta:goal-id ?id))))

(defrule goal-meta-template-invalid
  (declare (salience ?*SALIENCE-FIRST*))
  (goal (id ?id) (mode ~RETRACTED)
        (meta-template ?template&~nil&:(not (goal-meta-template-known ?template))))
  =>
  (printout error "Goal " ?id " attached goal meta template '" ?template "' unknown" crlf))

(defrule goal-meta-fact-template-missing-goal-id
  (declare (salience ?*SALIENCE-FIRST*))
  (goal (id ?id) (meta-fact ~0) (meta-template ?template&~nil))
  (test (and (goal-meta-template-known ?template)
             (not (deftemplate-slot-existp ?template goal-id))))
  =>
  (printout error "Goal " ?id " uses meta fact '" ?template "' without slot 'goal-id'" crlf))

(defrule goal-meta-fact-init-fact-id
  "The goal has a fact of its template already: refer to the fact."
  (declare (salience ?*SALIENCE-HIGH*))
  ?goal <- (goal (id ?id) (meta-fact 0) (meta-template ?template&~nil))
  (test (and (goal-meta-template-usable ?template) (> (goal-meta-find ?template ?id) 0)))
  =>
  (cx-modify-goal ?goal (meta-fact (goal-meta-find ?template ?id))))

(defrule goal-assert-default-meta
  "The goal has no fact of its template: assert a fact with defaults."
  (declare (salience ?*SALIENCE-HIGH*))
  ?goal <- (goal (id ?id) (meta-fact 0) (mode FORMULATED) (verbosity ?verbosity)
                 (meta-template ?template&~nil))
  (test (and (goal-meta-template-usable ?template) (eq 0 (goal-meta-find ?template ?id))))
  =>
  (bind ?meta (cx-assert-data (str-cat "(" ?template " (goal-id " ?id "))")))
  (cx-modify-goal ?goal (meta-fact (fact-index ?meta)))
  (if (eq ?verbosity NOISY) then
    (printout t "Goal " ?id " attached default meta fact from template " ?template crlf)))

(defrule goal-meta-link-new
  (declare (salience ?*SALIENCE-HIGH*))
  (goal (id ?id) (meta-fact ?index&~0))
  (not (goal-meta-link (goal-id ?id) (index ?index)))
  =>
  (assert (goal-meta-link (goal-id ?id) (index ?index)
                          (fact (if (fact-existp ?index) then (fact-index-to-fact ?index))))))

(defrule goal-meta-link-outdated
  (declare (salience ?*SALIENCE-HIGH*))
  ?link <- (goal-meta-link (goal-id ?id) (index ?index))
  (not (goal (id ?id) (meta-fact ?index)))
  =>
  (retract ?link))

(defrule goal-update-meta-template
  "Set the template to that of the fact, which has precedence."
  (declare (salience ?*SALIENCE-HIGH*))
  (goal-meta-link (goal-id ?id) (index ?index) (fact ?fact&~FALSE))
  ?goal <- (goal (id ?id) (meta-fact ?index) (meta-template ?template))
  (test (and (fact-existp ?fact) (neq ?template (fact-relation ?fact))))
  =>
  (cx-modify-goal ?goal (meta-template (fact-relation ?fact))))

(defrule goal-meta-fact-init-goal-id
  "Set the goal-id of the fact to the goal that refers to the fact."
  (declare (salience ?*SALIENCE-HIGH*))
  (goal-meta-link (goal-id ?id) (index ?index) (fact ?fact&~FALSE))
  (goal (id ?id) (meta-fact ?index))
  (test (and (fact-existp ?fact)
             (deftemplate-slot-existp (fact-relation ?fact) goal-id)
             (neq ?id (fact-slot-value ?fact goal-id))))
  =>
  (modify ?fact (goal-id ?id)))

(defrule goal-meta-ambiguous-meta-facts
  "A goal has several facts of one template. Reported once for each link between a goal and a fact."
  (declare (salience ?*SALIENCE-HIGH*))
  (goal-meta-link (goal-id ?id) (fact ?fact&~FALSE))
  (test (and (fact-existp ?fact)
             (deftemplate-slot-existp (fact-relation ?fact) goal-id)
             (> (goal-meta-count (fact-relation ?fact) ?id) 1)))
  =>
  (printout error "Goal " ?id " has ambiguous meta facts" crlf))

(defrule goal-meta-fact-update
  "The fact is gone. If a rule of the agent has modified the fact, which makes a new fact, the goal
   refers to the new fact."
  (declare (salience ?*SALIENCE-HIGH*))
  (goal-meta-link (goal-id ?id) (index ?index) (fact ?fact))
  ?goal <- (goal (id ?id) (meta-fact ?index) (meta-template ?template&~nil))
  (time $?)  ; check again at each tick
  (test (or (eq ?fact FALSE) (not (fact-existp ?fact))))
  =>
  (bind ?newer 0)
  (if (goal-meta-template-usable ?template) then
    (bind ?newer (goal-meta-find ?template ?id)))
  (if (> ?newer 0)
   then (cx-modify-goal ?goal (meta-fact ?newer))
   else (cx-modify-goal ?goal (meta-fact 0) (meta-template nil))))

(defrule goal-cleanup-meta-facts
  "Retract the meta fact before the goal is retracted."
  (declare (salience ?*SALIENCE-HIGH*))
  (confval (path "/clips-executive/automatic-goal-retraction") (type BOOL) (value TRUE))
  (goal-meta-link (goal-id ?id) (index ?index) (fact ?fact&~FALSE))
  ?goal <- (goal (id ?id) (meta-fact ?index) (mode RETRACTED))
  (test (fact-existp ?fact))
  =>
  (retract ?fact)
  (cx-modify-goal ?goal (meta-fact 0)))
